"""The physics and the environment on CUDA GPUs, compiled from the same kernels (extra ``gpu``)."""
