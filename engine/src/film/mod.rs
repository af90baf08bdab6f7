//! Pictures: accumulation, files, tone curves, error metrics.
