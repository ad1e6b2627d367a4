"""stub."""


def write(*a):
    print(len(a[1]))
