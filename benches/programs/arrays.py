# Elements of arrays, read and written.
import time


def run():
    a = [0] * 101
    s = 0
    for _ in range(1, 20001):
        for i in range(1, 101):
            a[i] = a[i - 1] + i
            s = s + a[i]
        a[0] = a[100] - a[99]
        if s > 100000000:
            s = s - 100000000
    return s


begin = time.process_time()
result = run()
print(time.process_time() - begin, result)
