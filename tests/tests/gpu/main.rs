//! The device: its limits, calls that are refused, and kernels that change while it runs.

mod driver_limits;
mod gpu_limits;
mod hot_reload;
mod safe_calls;
