# A script that must fail: it shows that the lock holds.


def boot(arguments):
    pass


def locked():
    return [0] * 100


def report():
    print("never reached")
