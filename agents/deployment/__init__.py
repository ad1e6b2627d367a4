"""Policies for other programs: ONNX models and C headers, each with its contract."""

from agents.deployment.c_header import export_c
from agents.deployment.contract import contract_path
from agents.deployment.onnx_model import export_onnx
from agents.deployment.quantisation import with_int8_weights

__all__ = ["contract_path", "export_c", "export_onnx", "with_int8_weights"]
