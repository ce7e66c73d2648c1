"""The processes that torchrun starts: their ranks, waiting for each other, one clock."""

import os
from datetime import timedelta

import torch
from torch import distributed

PATIENCE = timedelta(minutes=10)  # of a process for the others


class Processes:
    """Joins the processes that torchrun started, if it did; gives this one's rank. Leaves them again at the end."""

    def __enter__(self) -> int:
        if "WORLD_SIZE" not in os.environ:
            return 0
        distributed.init_process_group("nccl" if torch.cuda.is_available() else "gloo", timeout=PATIENCE)
        if torch.cuda.is_available():
            torch.cuda.set_device(int(os.environ["LOCAL_RANK"]))
        return distributed.get_rank()

    def __exit__(self, *error: object) -> None:
        if distributed.is_initialized():
            distributed.destroy_process_group()


def wait() -> None:
    """For all processes to come here."""
    if distributed.is_initialized():
        distributed.barrier()


def share_first(seconds: float) -> float:
    """The first process's clock, so that all stop after the same step."""
    if not distributed.is_initialized():
        return seconds
    clock = torch.tensor([seconds], dtype=torch.float64, device="cuda" if torch.cuda.is_available() else "cpu")
    distributed.broadcast(clock, 0)
    return clock.item()
