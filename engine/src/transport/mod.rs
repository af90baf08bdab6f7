//! What light does: reflectance, Fresnel, samplers, path sets, the reference path tracer.
