# Arithmetic of reals with functions.
import time
from math import pi, sin, sqrt


def run():
    degree = pi / 180
    s = 0.0
    for i in range(1, 1000001):
        x = i / 1000.0
        s = s + sqrt(x) * 0.5 - sin(x * degree)
        if s > 1000.0:
            s = s - 1000.0
    return s


begin = time.process_time()
result = run()
print(time.process_time() - begin, result)
