//! Raster preview: shadow maps against shadow rays, light probes against closed forms and rays, moved objects.

mod bits;
mod cubes;
mod fading;
mod light;
mod live;
mod moving;
mod penumbra;
mod planar;
mod reflections;
mod search;
mod shadows;
mod subject;
mod technique;
