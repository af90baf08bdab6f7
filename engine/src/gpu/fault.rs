//! A dispatch table that fails on purpose: the n-th call of a Vulkan command returns an error code.
//!
//! Software drivers never lose a device or run out of memory by themselves, so this is how those errors are reached in tests. The count is
//! process-wide: tests that plan a fault run one at a time in a process of their own. A second device with a plan is refused while the first is
//! alive.

use std::ffi::{CStr, c_void};
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicPtr, AtomicU32, Ordering};

use ash::vk;

use crate::{Error, Result};

/// Which call fails, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultPlan {
    /// The command.
    pub call: FaultCall,
    /// 1 is the first call of it.
    pub nth: u32,
    /// What it returns; later calls work again, except that a lost device stays lost.
    pub result: vk::Result,
}

static PLANNED_CALL: AtomicU32 = AtomicU32::new(u32::MAX);
static REMAINING: AtomicI32 = AtomicI32::new(0);
static RESULT: AtomicI32 = AtomicI32::new(0);

/// A device with a plan is alive.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// The one device that has a plan. The trampolines know the entry points of one device, and those of another may belong to another driver.
#[derive(Debug)]
pub(super) struct Claim(());

impl Claim {
    /// Fails while another device has a plan.
    pub fn take() -> Result<Self> {
        if TAKEN.swap(true, Ordering::SeqCst) {
            let cause = "is planned for a second device; one at a time has a plan";
            return Err(Error::setting("fault", "a plan", cause));
        }
        Ok(Self(()))
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        TAKEN.store(false, Ordering::SeqCst);
    }
}

/// The planned error, when this call is the one.
fn planned(call: FaultCall) -> Option<vk::Result> {
    if PLANNED_CALL.load(Ordering::SeqCst) != call as u32 {
        return None;
    }
    let result = vk::Result::from_raw(RESULT.load(Ordering::SeqCst));
    let before = REMAINING.fetch_sub(1, Ordering::SeqCst);
    (before == 1 || (before < 1 && result == vk::Result::ERROR_DEVICE_LOST)).then_some(result)
}

macro_rules! faulty_calls {
    ($($variant:ident = $name:literal, $pfn:ident, $trampoline:ident ( $($argument:ident : $kind:ty),* ) ;)*) => {
        /// Commands that can be made to fail.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum FaultCall {
            $(#[doc = concat!("`", $name, "`")] $variant,)*
        }

        $(
            unsafe extern "system" fn $trampoline($($argument: $kind),*) -> vk::Result {
                static_real!($trampoline);
                if let Some(result) = planned(FaultCall::$variant) {
                    return result;
                }
                let real = REAL.load(Ordering::SeqCst);
                // SAFETY: `wrap` stored the driver's own pointer of exactly this command before it handed out the trampoline.
                let real: vk::$pfn = unsafe { std::mem::transmute(real) };
                // SAFETY: the arguments are the caller's, under the caller's promises.
                unsafe { real($($argument),*) }
            }
        )*

        /// The trampoline for a command, after remembering the real one.
        fn substitute(name: &CStr, real: *const c_void) -> *const c_void {
            match name.to_bytes() {
                $(name if name == $name.as_bytes() => {
                    real::$trampoline.store(real.cast_mut(), Ordering::SeqCst);
                    $trampoline as *const c_void
                })*
                _ => real,
            }
        }

        mod real {
            use super::*;
            $(#[expect(non_upper_case_globals, reason = "named like the trampolines")] pub static $trampoline: AtomicPtr<c_void> = AtomicPtr::new(std::ptr::null_mut());)*
        }
    };
}

macro_rules! static_real {
    ($trampoline:ident) => {
        use real::$trampoline as REAL;
    };
}

faulty_calls! {
    AllocateMemory = "vkAllocateMemory", PFN_vkAllocateMemory, allocate_memory(
        device: vk::Device, info: *const vk::MemoryAllocateInfo<'_>, callbacks: *const vk::AllocationCallbacks<'_>, out: *mut vk::DeviceMemory);
    CreateBuffer = "vkCreateBuffer", PFN_vkCreateBuffer, create_buffer(
        device: vk::Device, info: *const vk::BufferCreateInfo<'_>, callbacks: *const vk::AllocationCallbacks<'_>, out: *mut vk::Buffer);
    CreateImage = "vkCreateImage", PFN_vkCreateImage, create_image(
        device: vk::Device, info: *const vk::ImageCreateInfo<'_>, callbacks: *const vk::AllocationCallbacks<'_>, out: *mut vk::Image);
    CreateComputePipelines = "vkCreateComputePipelines", PFN_vkCreateComputePipelines, create_compute_pipelines(
        device: vk::Device, cache: vk::PipelineCache, count: u32, infos: *const vk::ComputePipelineCreateInfo<'_>,
        callbacks: *const vk::AllocationCallbacks<'_>, out: *mut vk::Pipeline);
    CreateCommandPool = "vkCreateCommandPool", PFN_vkCreateCommandPool, create_command_pool(
        device: vk::Device, info: *const vk::CommandPoolCreateInfo<'_>, callbacks: *const vk::AllocationCallbacks<'_>, out: *mut vk::CommandPool);
    AllocateDescriptorSets = "vkAllocateDescriptorSets", PFN_vkAllocateDescriptorSets, allocate_descriptor_sets(
        device: vk::Device, info: *const vk::DescriptorSetAllocateInfo<'_>, out: *mut vk::DescriptorSet);
    QueueSubmit = "vkQueueSubmit2", PFN_vkQueueSubmit2, queue_submit(
        queue: vk::Queue, count: u32, infos: *const vk::SubmitInfo2<'_>, fence: vk::Fence);
    WaitSemaphores = "vkWaitSemaphores", PFN_vkWaitSemaphores, wait_semaphores(
        device: vk::Device, info: *const vk::SemaphoreWaitInfo<'_>, timeout: u64);
}

/// The same device behind trampolines.
pub(super) fn wrap(instance: &ash::Instance, device: &ash::Device, plan: FaultPlan) -> ash::Device {
    RESULT.store(plan.result.as_raw(), Ordering::SeqCst);
    REMAINING.store(plan.nth.min(i32::MAX as u32) as i32, Ordering::SeqCst);
    PLANNED_CALL.store(plan.call as u32, Ordering::SeqCst);
    let get = instance.fp_v1_0().get_device_proc_addr;
    let load = |name: &CStr| {
        // SAFETY: the device is alive; an unknown name gives null, which ash replaces by a stub.
        let real = unsafe { get(device.handle(), name.as_ptr()) };
        let real = real.map_or(std::ptr::null(), |function| function as *const c_void);
        if real.is_null() { real } else { substitute(name, real) }
    };
    // SAFETY: every pointer is the driver's own or a trampoline of the same signature.
    unsafe { ash::Device::load_with(load, device.handle()) }
}
