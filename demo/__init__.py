"""The two ends of the line: devices and command line in front, window, files and pictures behind."""

import os
import time

STARTED = time.perf_counter()  # before anything heavy is imported: reports count start-up from here
os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")  # pygame greets on stdout, which belongs to the commands
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # numpy's: a frame is too little work for a second thread
