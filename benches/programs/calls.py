# Calls of a function with an argument and a result.
import time


def mix(n):
    t = n * 7
    return t - t // 16 * 16


def run():
    s = 0
    for i in range(1, 1000001):
        r = mix(i)
        s = s + r
        if s > 1000000:
            s = s - 1000000
    return s


begin = time.process_time()
result = run()
print(time.process_time() - begin, result)
