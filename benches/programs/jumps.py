# The same loop; there is no goto.
import time


def run():
    i = 0
    s = 0
    while True:
        i = i + 1
        k = i % 3
        if k == 1:
            s = s + 1
        elif k == 2:
            s = s - 2
        else:
            s = s + 5
        if i >= 1000000:
            return s


begin = time.process_time()
result = run()
print(time.process_time() - begin, result)
