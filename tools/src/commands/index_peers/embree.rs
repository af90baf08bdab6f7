//! Intel's Embree as a peer, loaded at run time where it is installed: versions 3 and 4, one ray per call, all threads.
//!
//! Source of the interface: the headers of Embree 3.13 and 4 (rtcore_*.h, Apache-2.0). Nothing is linked, and a library that is not there,
//! or is none of these versions, is a peer that is absent, with the reason.
//!
//! Guarantee: all unsafe code of the comparison is in this file, and each block says why it holds. A safe caller can do no harm: trees are
//! released before their device, the device before the library is unloaded, and only trees that are built can be asked.

#![expect(unsafe_code, reason = "a C library is called here")]

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::mem::ManuallyDrop;

use clerestory::accel::Ray;
use clerestory::{Error, Result};
use clerestory_tools::timing::timed;
use glam::Vec3;
use libloading::Library;

use super::Intersection;

/// Names under which systems know the library, newest first.
const NAMES: [&str; 8] = [
    "libembree4.so.4",
    "libembree4.so",
    "libembree4.dylib",
    "embree4.dll",
    "libembree3.so.3",
    "libembree3.so",
    "libembree3.dylib",
    "embree3.dll",
];

// Values of the headers' enumerations that both versions share.
const GEOMETRY_TYPE_TRIANGLE: c_int = 0;
const BUFFER_TYPE_INDEX: c_int = 0;
const BUFFER_TYPE_VERTEX: c_int = 1;
const FORMAT_UINT3: c_int = 0x5003;
const FORMAT_FLOAT3: c_int = 0x9003;
const SCENE_FLAG_ROBUST: c_int = 1 << 2;
const DEVICE_PROPERTY_VERSION: c_int = 0;
const INVALID_ID: c_uint = c_uint::MAX;
const ALL_MASKS: c_uint = c_uint::MAX;

/// A pointer to something of the library's.
type Handle = *mut c_void;

/// `RTCRayHit` for one level of instances, which is how the library is built unless asked otherwise; the words at the end leave room for
/// the ids of more levels and of arrays of instances.
#[repr(C, align(16))]
#[derive(Debug, Clone, Copy)]
struct RayHit {
    origin: [f32; 3],
    t_near: f32,
    direction: [f32; 3],
    time: f32,
    t_far: f32,
    mask: c_uint,
    id: c_uint,
    flags: c_uint,
    normal: [f32; 3],
    barycentrics: [f32; 2],
    primitive: c_uint,
    geometry: c_uint,
    instance: [c_uint; 9],
}

impl From<&Ray> for RayHit {
    fn from(ray: &Ray) -> Self {
        Self {
            origin: ray.origin,
            t_near: ray.t_min,
            direction: ray.direction,
            time: 0.0,
            t_far: ray.t_max,
            mask: ALL_MASKS,
            id: 0,
            flags: 0,
            normal: [0.0; 3],
            barycentrics: [0.0; 2],
            primitive: INVALID_ID,
            geometry: INVALID_ID,
            instance: [INVALID_ID; 9],
        }
    }
}

/// `RTCIntersectContext` of version 3, rays in any order; the words at the end leave room as in [`RayHit`].
#[repr(C, align(16))]
struct Context {
    flags: c_int,
    filter: *const c_void,
    instance: [c_uint; 16],
}

/// How a ray is asked, which is where the versions differ.
#[derive(Clone, Copy)]
enum Intersect {
    /// Scene, context, ray.
    Version3(unsafe extern "C" fn(Handle, *mut Context, *mut RayHit)),
    /// Scene, ray, arguments that may be null.
    Version4(unsafe extern "C" fn(Handle, *mut RayHit, *mut c_void)),
}

/// The library's functions that are used.
struct Functions {
    new_device: unsafe extern "C" fn(*const c_char) -> Handle,
    release_device: unsafe extern "C" fn(Handle),
    device_error: unsafe extern "C" fn(Handle) -> c_int,
    device_property: unsafe extern "C" fn(Handle, c_int) -> isize,
    new_scene: unsafe extern "C" fn(Handle) -> Handle,
    release_scene: unsafe extern "C" fn(Handle),
    set_scene_flags: unsafe extern "C" fn(Handle, c_int),
    commit_scene: unsafe extern "C" fn(Handle),
    new_geometry: unsafe extern "C" fn(Handle, c_int) -> Handle,
    release_geometry: unsafe extern "C" fn(Handle),
    new_buffer: unsafe extern "C" fn(Handle, c_int, c_uint, c_int, usize, usize) -> Handle,
    commit_geometry: unsafe extern "C" fn(Handle),
    attach_geometry: unsafe extern "C" fn(Handle, Handle) -> c_uint,
}

/// The library with a device of its.
pub struct Embree {
    functions: Functions,
    intersect: Intersect,
    device: Handle,
    version: isize,
    // Never unloaded: the library's threads outlive its devices, and their code must stay.
    _library: ManuallyDrop<Library>,
}

/// A function by its C name.
fn function<T: Copy>(library: &Library, name: &str) -> std::result::Result<T, String> {
    // SAFETY: the callers below ask for each name with the type that the headers give it; the pointer is kept no longer than the library.
    let found = unsafe { library.get::<T>(name.as_bytes()) };
    found.map(|symbol| *symbol).map_err(|_| format!("it has no {name}"))
}

impl Functions {
    fn of(library: &Library) -> std::result::Result<Self, String> {
        Ok(Self {
            new_device: function(library, "rtcNewDevice")?,
            release_device: function(library, "rtcReleaseDevice")?,
            device_error: function(library, "rtcGetDeviceError")?,
            device_property: function(library, "rtcGetDeviceProperty")?,
            new_scene: function(library, "rtcNewScene")?,
            release_scene: function(library, "rtcReleaseScene")?,
            set_scene_flags: function(library, "rtcSetSceneFlags")?,
            commit_scene: function(library, "rtcCommitScene")?,
            new_geometry: function(library, "rtcNewGeometry")?,
            release_geometry: function(library, "rtcReleaseGeometry")?,
            new_buffer: function(library, "rtcSetNewGeometryBuffer")?,
            commit_geometry: function(library, "rtcCommitGeometry")?,
            attach_geometry: function(library, "rtcAttachGeometry")?,
        })
    }
}

impl Embree {
    /// Loads the library and makes a device with that many threads; the reason where that cannot be.
    pub fn load(threads: usize) -> std::result::Result<Self, String> {
        // SAFETY: initialisers of the library run; Embree's have no demands, and a name of the list is taken to be Embree.
        let library = NAMES.iter().find_map(|name| unsafe { Library::new(name) }.ok());
        let library = library.ok_or("no library libembree4 or libembree3 is installed")?;
        let functions = Functions::of(&library)?;
        let settings = CString::new(format!("threads={threads}")).map_err(|cause| cause.to_string())?;
        // SAFETY: the text ends with a zero and outlives the call.
        let device = unsafe { (functions.new_device)(settings.as_ptr()) };
        if device.is_null() {
            return Err("it makes no device".into());
        }
        // SAFETY: the device is there.
        let version = unsafe { (functions.device_property)(device, DEVICE_PROPERTY_VERSION) };
        let intersect = match version / 10_000 {
            3 => function(&library, "rtcIntersect1").map(Intersect::Version3),
            4 => function(&library, "rtcIntersect1").map(Intersect::Version4),
            _ => Err(format!("its version is {version}, and 3 and 4 are known")),
        };
        let intersect = intersect.inspect_err(|_| {
            // SAFETY: the device is there, and nothing else was made of it.
            unsafe { (functions.release_device)(device) }
        })?;
        Ok(Self {
            functions,
            intersect,
            device,
            version,
            _library: ManuallyDrop::new(library),
        })
    }

    /// As in its documentation.
    pub fn version(&self) -> String {
        let version = self.version;
        format!("{}.{}.{}", version / 10_000, version / 100 % 100, version % 100)
    }

    /// Fails with the last error of the device since it was asked before.
    fn check(&self, doing: &str) -> Result<()> {
        // SAFETY: the device lives as long as this.
        match unsafe { (self.functions.device_error)(self.device) } {
            0 => Ok(()),
            code => Err(Error::setting("embree", doing, format!("failed with its error {code}"))),
        }
    }

    /// A buffer of a geometry, filled; the library owns and pads it.
    fn fill<T: Copy>(&self, geometry: Handle, kind: c_int, format: c_int, items: &[[T; 3]]) -> Result<()> {
        let (stride, count) = (size_of::<[T; 3]>(), items.len());
        // SAFETY: the geometry lives, and the format has the stride.
        let memory = unsafe { (self.functions.new_buffer)(geometry, kind, 0, format, stride, count) };
        self.check("memory")?;
        if memory.is_null() {
            return Err(Error::setting("embree", "memory", "is not there"));
        }
        // SAFETY: the library has just given count × stride bytes, aligned for its format, which nobody else sees yet.
        unsafe { memory.cast::<[T; 3]>().copy_from_nonoverlapping(items.as_ptr(), count) };
        Ok(())
    }

    /// Builds over triangles with the quality that the library has by default. Robust trees let no ray pass between triangles. Also gives the seconds
    /// of the build alone, without copying.
    ///
    /// # Errors
    /// [`Error::Setting`] with the library's number of an error.
    pub fn build(&self, triangles: &[[Vec3; 3]], robust: bool) -> Result<(Tree<'_>, f64)> {
        let corners: Vec<[f32; 3]> = triangles.iter().flatten().map(|corner| corner.to_array()).collect();
        let indices: Vec<[c_uint; 3]> = (0..triangles.len() as c_uint)
            .map(|i| [3 * i, 3 * i + 1, 3 * i + 2])
            .collect();
        // SAFETY: the device lives as long as this.
        let scene = unsafe { (self.functions.new_scene)(self.device) };
        self.check("scene")?;
        // From here on the scene is released whatever happens.
        let tree = Tree { embree: self, scene };
        // SAFETY: the device lives as long as this.
        let geometry = unsafe { (self.functions.new_geometry)(self.device, GEOMETRY_TYPE_TRIANGLE) };
        self.check("geometry")?;
        let filled = self
            .fill(geometry, BUFFER_TYPE_VERTEX, FORMAT_FLOAT3, &corners)
            .and_then(|()| self.fill(geometry, BUFFER_TYPE_INDEX, FORMAT_UINT3, &indices));
        // SAFETY: scene and geometry live; the scene keeps its own reference to the geometry, so that ours is given back here.
        let ((), seconds) = timed(|| unsafe {
            (self.functions.set_scene_flags)(scene, if robust { SCENE_FLAG_ROBUST } else { 0 });
            (self.functions.commit_geometry)(geometry);
            (self.functions.attach_geometry)(scene, geometry);
            (self.functions.release_geometry)(geometry);
            (self.functions.commit_scene)(scene);
        });
        filled?;
        self.check("build")?;
        Ok((tree, seconds))
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: trees borrow this, so that none is left.
        unsafe { (self.functions.release_device)(self.device) }
    }
}

/// A tree that was built.
pub struct Tree<'a> {
    embree: &'a Embree,
    scene: Handle,
}

// SAFETY: behind a shared reference a tree can only be asked for hits, which the library allows on any number of threads at once between
// commits, and a tree is committed once, before anyone has it.
unsafe impl Sync for Tree<'_> {}

impl Tree<'_> {
    /// The closest hit of a ray.
    pub fn closest_hit(&self, ray: &Ray) -> Intersection {
        let mut query = RayHit::from(ray);
        match self.embree.intersect {
            Intersect::Version3(intersect) => {
                let mut context = Context {
                    flags: 0,
                    filter: std::ptr::null(),
                    instance: [INVALID_ID; 16],
                };
                // SAFETY: the scene is committed; context and ray are laid out as the header has them, are aligned, and are ours alone.
                unsafe { intersect(self.scene, &mut context, &mut query) }
            }
            // SAFETY: as above; without arguments the library takes its defaults.
            Intersect::Version4(intersect) => unsafe { intersect(self.scene, &mut query, std::ptr::null_mut()) },
        }
        if query.geometry == INVALID_ID {
            Intersection::NONE
        } else {
            Intersection {
                t: query.t_far,
                triangle: query.primitive,
            }
        }
    }
}

impl Drop for Tree<'_> {
    fn drop(&mut self) {
        // SAFETY: the scene was made by the device, which the borrow keeps, and is released here only.
        unsafe { (self.embree.functions.release_scene)(self.scene) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_have_the_layout_of_the_headers() {
        use std::mem::offset_of;
        let places = [
            offset_of!(RayHit, direction),
            offset_of!(RayHit, t_far),
            offset_of!(RayHit, normal),
            offset_of!(RayHit, barycentrics),
            offset_of!(RayHit, primitive),
            offset_of!(RayHit, geometry),
            offset_of!(RayHit, instance),
        ];
        assert_eq!(places, [16, 32, 48, 60, 68, 72, 76]);
        assert_eq!((size_of::<RayHit>(), align_of::<RayHit>()), (112, 16));
        assert_eq!((offset_of!(Context, filter), offset_of!(Context, instance)), (8, 16));
    }

    #[test]
    fn an_installed_library_finds_the_nearer_triangle_and_an_absent_one_gives_the_reason() {
        let embree = match Embree::load(1) {
            Ok(embree) => embree,
            Err(reason) => {
                assert!(!reason.is_empty());
                return;
            }
        };
        let at = |z: f32| {
            [
                Vec3::new(-1.0, -1.0, z),
                Vec3::new(1.0, -1.0, z),
                Vec3::new(0.0, 1.0, z),
            ]
        };
        for robust in [false, true] {
            let (tree, seconds) = embree.build(&[at(3.0), at(2.0)], robust).unwrap();
            let ray = |x: f32| Ray {
                origin: [x, 0.0, 0.0],
                t_min: 0.0,
                direction: [0.0, 0.0, 1.0],
                t_max: f32::INFINITY,
            };
            assert_eq!(tree.closest_hit(&ray(0.1)), Intersection { t: 2.0, triangle: 1 });
            assert_eq!(tree.closest_hit(&ray(2.0)), Intersection::NONE);
            assert!(seconds > 0.0);
        }
        assert!(embree.version().starts_with(['3', '4']));
    }
}
