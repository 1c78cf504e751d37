# A counting loop: integer arithmetic and if.
import time


def run():
    s = 0
    for i in range(1, 3000001):
        s = s + i * 3
        if s > 4000000:
            s = s - 9000000
    return s


begin = time.process_time()
result = run()
print(time.process_time() - begin, result)
