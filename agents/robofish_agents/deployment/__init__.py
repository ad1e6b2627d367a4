"""Policies for other programs: ONNX models and C headers, each with its contract."""

from robofish_agents.deployment.c_header import export_c
from robofish_agents.deployment.contract import contract_path
from robofish_agents.deployment.onnx_model import export_onnx
from robofish_agents.deployment.quantisation import with_int8_weights

__all__ = ["contract_path", "export_c", "export_onnx", "with_int8_weights"]
