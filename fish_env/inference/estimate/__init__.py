"""Estimation: bounded Gauss-Newton on whitened residuals under normal priors."""
