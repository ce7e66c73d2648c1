"""How torch runs in a session: set here, by every model that is built to run, and nowhere else."""


def set_up_torch(one_thread: bool = True) -> None:
    """Flushes denormals, which else cost a hundredfold at strength 0, and takes one thread.

    A frame is too little work for a second thread, and one thread adds in one order: same input, same motion. Training
    takes the threads that there are: `one_thread` False."""
    import torch

    torch.set_flush_denormal(True)
    if one_thread:
        torch.set_num_threads(1)
