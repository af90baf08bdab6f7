//! Spatial indexes and their traversal.
