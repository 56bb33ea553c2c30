"""What the scripts beside it say when they cannot do their work: one line, exit status 1; of wrong usage 2."""
import os
import sys


def fail(message, status=1):
    print(f"{os.path.basename(sys.argv[0])}: {message}", file=sys.stderr)
    sys.exit(status)


def usage(text):
    print(text, file=sys.stderr)
    sys.exit(2)
