//! Device memory: named allocations, counted by category.

use std::collections::BTreeMap;
use std::sync::Mutex;

use ash::vk::{self, Handle};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};

use crate::{Error, Result};

/// What an allocation is for; bytes are counted by it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Category {
    /// Triangles and vertex attributes.
    Geometry,
    /// Spatial indexes.
    Index,
    /// Materials and textures.
    Material,
    /// Lights and environment.
    Light,
    /// Path states, queues and other working memory.
    Work,
    /// Accumulated pictures.
    Film,
    /// Upload, readback and bookkeeping.
    Staging,
}

const CATEGORIES: [Category; 7] = [
    Category::Geometry,
    Category::Index,
    Category::Material,
    Category::Light,
    Category::Work,
    Category::Film,
    Category::Staging,
];

/// Bytes in use, by category, in the order of the enum; empty categories are left out.
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize)]
#[non_exhaustive]
pub struct MemoryReport {
    /// Category and bytes.
    pub bytes: Vec<(Category, u64)>,
    /// Number of live allocations.
    pub allocations: u64,
}

impl MemoryReport {
    /// Bytes in one category.
    pub fn of(&self, category: Category) -> u64 {
        self.bytes
            .iter()
            .find(|(c, _)| *c == category)
            .map_or(0, |(_, bytes)| *bytes)
    }

    /// Bytes in all categories.
    pub fn total(&self) -> u64 {
        self.bytes.iter().map(|(_, bytes)| bytes).sum()
    }
}

/// One live allocation.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[non_exhaustive]
pub struct AllocationInfo {
    /// The buffer's or image's name.
    pub name: String,
    /// What it is counted as.
    pub category: Category,
    /// Size in bytes.
    pub bytes: u64,
}

/// The device's memory.
pub(super) struct Memory {
    limits: HeapLimits,
    state: Mutex<State>,
}

/// How many bytes there are. Drivers need not refuse to allocate more than that: software drivers take it from the host, whose system
/// ends the process when the pages are touched.
#[derive(Debug, Clone, Copy)]
struct HeapLimits {
    /// Of the device-local heaps.
    device_local: u64,
    /// Of all heaps.
    all: u64,
}

impl HeapLimits {
    fn of(instance: &ash::Instance, physical_device: vk::PhysicalDevice, at_most: Option<u64>) -> Self {
        // SAFETY: the physical device belongs to the instance.
        let properties = unsafe { instance.get_physical_device_memory_properties(physical_device) };
        let heaps = &properties.memory_heaps[..properties.memory_heap_count as usize];
        let sum = |flags| {
            let sizes = heaps
                .iter()
                .filter(|heap| heap.flags.contains(flags))
                .map(|heap| heap.size);
            sizes.fold(0, u64::saturating_add).min(at_most.unwrap_or(u64::MAX))
        };
        Self {
            device_local: sum(vk::MemoryHeapFlags::DEVICE_LOCAL),
            all: sum(vk::MemoryHeapFlags::empty()),
        }
    }
}

struct State {
    /// `None` only while the owner drops.
    allocator: Option<Allocator>,
    bytes: [u64; CATEGORIES.len()],
    /// Bytes in memory that the host need not reach.
    device_only: u64,
    /// By memory object and offset, each with its place.
    live: BTreeMap<(u64, u64), (AllocationInfo, MemoryLocation)>,
}

impl State {
    /// Fails when `more` bytes and all that are in use are more than there are.
    fn check(&self, limits: &HeapLimits, name: &str, more: u64, location: MemoryLocation) -> Result<()> {
        let all: u64 = self.bytes.iter().sum();
        let mut places = vec![("the memory heaps", all, limits.all)];
        if location == MemoryLocation::GpuOnly {
            places.push(("the device-local memory heaps", self.device_only, limits.device_local));
        }
        for (heaps, used, limit) in places {
            if used.saturating_add(more) > limit {
                return Err(Error::OutOfMemory {
                    memory: "device",
                    name: name.into(),
                    bytes: more,
                    cause: format!("{used} bytes of the {limit} in {heaps} are in use"),
                });
            }
        }
        Ok(())
    }
}

impl Memory {
    /// `at_most` makes the heaps look smaller than they are; with `addresses` buffers may have device addresses.
    pub fn new(
        instance: &ash::Instance,
        device: &ash::Device,
        physical_device: vk::PhysicalDevice,
        at_most: Option<u64>,
        addresses: bool,
    ) -> Result<Self> {
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device,
            debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
            buffer_device_address: addresses,
            allocation_sizes: gpu_allocator::AllocationSizes::default(),
        })
        .map_err(|error| out_of_memory("allocator", 0, &error))?;
        Ok(Self {
            limits: HeapLimits::of(instance, physical_device, at_most),
            state: Mutex::new(State {
                allocator: Some(allocator),
                bytes: [0; CATEGORIES.len()],
                device_only: 0,
                live: BTreeMap::new(),
            }),
        })
    }

    /// Allocates; the caller binds.
    pub fn allocate(
        &self,
        name: &str,
        category: Category,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation> {
        let mut state = self.lock();
        state.check(&self.limits, name, requirements.size, location)?;
        let Some(allocator) = state.allocator.as_mut() else {
            return Err(Error::OutOfMemory {
                memory: "device",
                name: name.into(),
                bytes: requirements.size,
                cause: "the device is being destroyed".into(),
            });
        };
        let allocation = allocator
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location,
                linear,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|error| out_of_memory(name, requirements.size, &error))?;
        state.bytes[category as usize] += requirements.size;
        if location == MemoryLocation::GpuOnly {
            state.device_only += requirements.size;
        }
        state.live.insert(
            place(&allocation),
            (
                AllocationInfo {
                    name: name.into(),
                    category,
                    bytes: requirements.size,
                },
                location,
            ),
        );
        Ok(allocation)
    }

    /// Gives an allocation back. `bytes` is the size that was required.
    pub fn free(&self, category: Category, bytes: u64, allocation: Allocation) {
        let mut state = self.lock();
        if let Some((_, MemoryLocation::GpuOnly)) = state.live.remove(&place(&allocation)) {
            state.device_only -= bytes;
        }
        if let Some(allocator) = state.allocator.as_mut()
            && let Err(error) = allocator.free(allocation)
        {
            tracing::error!("freeing device memory: {error}");
        }
        state.bytes[category as usize] -= bytes;
    }

    /// Bytes in use now.
    pub fn report(&self) -> MemoryReport {
        let state = self.lock();
        MemoryReport {
            bytes: CATEGORIES
                .into_iter()
                .zip(state.bytes)
                .filter(|(_, bytes)| *bytes > 0)
                .collect(),
            allocations: state.live.len() as u64,
        }
    }

    /// Every live allocation, by name and then size.
    pub fn allocations(&self) -> Vec<AllocationInfo> {
        let mut list: Vec<_> = self.lock().live.values().map(|(info, _)| info.clone()).collect();
        list.sort_by(|a, b| (&a.name, a.bytes).cmp(&(&b.name, b.bytes)));
        list
    }

    /// Frees the allocator's blocks; must come before the device is destroyed.
    pub fn shut_down(&self) {
        drop(self.lock().allocator.take());
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, State> {
        // A panic while the lock was held leaves counters that are at worst stale.
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

/// The memory object and the offset in it, which no two live allocations share.
fn place(allocation: &Allocation) -> (u64, u64) {
    // SAFETY: the handle is only looked at.
    let memory = unsafe { allocation.memory() };
    (memory.as_raw(), allocation.offset())
}

fn out_of_memory(name: &str, bytes: u64, error: &gpu_allocator::AllocationError) -> Error {
    Error::OutOfMemory {
        memory: "device",
        name: name.into(),
        bytes,
        cause: error.to_string(),
    }
}
