//! Windows: a surface with its swapchain, one frame in flight.
//!
//! A frame is acquired, recorded by the caller into the swapchain's image, submitted, waited for and presented; so an image is never
//! touched twice at a time and every semaphore is free again when the next frame begins. Resizing and what the window system declares
//! out of date make the swapchain anew.

use std::sync::Arc;

use ash::{khr, vk};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};

use super::barrier::{Access, ImageBarrier};
use super::create::no_window;
use super::device::{Gpu, Inner};
use super::image::{Image, ImageInner};
use super::instance::vulkan;
use super::recorder::{Pass, Recorder};
use super::timing::Timings;
use crate::{Error, Result};

/// How often one frame tries again with a new swapchain before it gives up.
const ATTEMPTS: usize = 3;

/// What became of a frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Presented {
    /// It was handed to the window; the GPU times of its passes.
    Shown(Timings),
    /// The window has no area, or it changed under every attempt; try again after the next event.
    Skipped,
}

/// A window's surface. It keeps the window alive, and is destroyed before it.
pub struct Surface {
    handle: Gpu,
    inner: Arc<SurfaceInner>,
    swapchains: khr::swapchain::Device,
    format: vk::SurfaceFormatKHR,
    swapchain: Option<Swapchain>,
    acquired: vk::Semaphore,
}

/// A surface with its window, which goes after it.
struct SurfaceInner {
    gpu: Arc<Inner>,
    loader: khr::surface::Instance,
    raw: vk::SurfaceKHR,
    _window: Arc<dyn std::any::Any + Send + Sync>,
}

impl Drop for SurfaceInner {
    fn drop(&mut self) {
        // SAFETY: swapchains keep the surface, so there are none any more.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}

struct Swapchain {
    inner: Arc<SwapchainInner>,
    /// With each image the semaphore that its presentation waits for.
    images: Vec<(Image, vk::Semaphore)>,
}

/// A swapchain, which its images keep: whoever is handed one may keep it beyond its frame.
pub(super) struct SwapchainInner {
    surface: Arc<SurfaceInner>,
    device: khr::swapchain::Device,
    raw: vk::SwapchainKHR,
    pub size: [u32; 2],
    pub format: vk::Format,
    pub usage: vk::ImageUsageFlags,
}

impl SwapchainInner {
    pub fn gpu(&self) -> &Arc<Inner> {
        &self.surface.gpu
    }
}

impl Drop for SwapchainInner {
    fn drop(&mut self) {
        // SAFETY: its images are gone with their views, which submissions keep; the queue was idle when the surface gave it up.
        unsafe { self.device.destroy_swapchain(self.raw, None) };
    }
}

impl std::fmt::Debug for Surface {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Surface")
            .field("format", &self.format.format)
            .finish_non_exhaustive()
    }
}

impl Gpu {
    /// The surface of a window of the display that the device was made for by [`Gpu::for_window`].
    ///
    /// # Errors
    /// [`Error::MissingFeature`] when the device cannot present or the surface takes no copies, [`Error::Vulkan`].
    pub fn surface<W>(&self, window: Arc<W>) -> Result<Surface>
    where
        W: HasDisplayHandle + HasWindowHandle + Send + Sync + 'static,
    {
        let gpu = Arc::clone(&self.inner);
        let missing = |feature: &str, instead: &str| Error::MissingFeature {
            feature: feature.into(),
            needed_by: "presenting to a window".into(),
            device: gpu.caps.device.clone(),
            instead: instead.into(),
        };
        if !gpu.presents {
            return Err(missing("VK_KHR_swapchain", "make the device by Gpu::for_window"));
        }
        let display = window.display_handle().map_err(no_window)?.as_raw();
        let handle = window.window_handle().map_err(no_window)?.as_raw();
        let instance = &gpu.instance;
        // SAFETY: the window is kept alive by the surface.
        let raw = unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, handle, None) }
            .map_err(vulkan("vkCreateSurfaceKHR"))?;
        let inner = SurfaceInner {
            gpu: Arc::clone(&gpu),
            loader: khr::surface::Instance::new(&instance.entry, &instance.raw),
            raw,
            _window: window,
        };
        // SAFETY: surface and physical device belong to one instance.
        let supported = unsafe {
            inner
                .loader
                .get_physical_device_surface_support(gpu.physical_device, gpu.queue_family, raw)
        };
        if !supported.map_err(vulkan("vkGetPhysicalDeviceSurfaceSupportKHR"))? {
            return Err(missing("a queue that presents to this window", "choose another device"));
        }
        // SAFETY: as above.
        let formats = unsafe {
            inner
                .loader
                .get_physical_device_surface_formats(gpu.physical_device, raw)
        }
        .map_err(vulkan("vkGetPhysicalDeviceSurfaceFormatsKHR"))?;
        let plain = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM];
        let format = formats
            .iter()
            .find(|format| plain.contains(&format.format))
            .copied()
            .ok_or_else(|| missing("a surface format of four plain bytes", "choose another device"))?;
        Ok(Surface {
            handle: self.clone(),
            inner: Arc::new(inner),
            swapchains: khr::swapchain::Device::new(&instance.raw, &gpu.device),
            format,
            swapchain: None,
            acquired: vk::Semaphore::null(),
        })
    }
}

impl Surface {
    /// The images' format: `B8G8R8A8_UNORM` or `R8G8B8A8_UNORM`. What is written to it is shown as it is, so it wants display values.
    pub fn format(&self) -> vk::Format {
        self.format.format
    }

    fn gpu(&self) -> &Arc<Inner> {
        &self.inner.gpu
    }

    /// Shows one frame. `record` records what comes before, for the size in pixels that it is given; `finish` then fills the image, in layout
    /// `TRANSFER_DST_OPTIMAL`, in a pass of its own. `size` is the window's inner size, for window systems that leave the choice.
    ///
    /// # Errors
    /// Whatever the closures return; [`Error::DeviceLost`], [`Error::OutOfMemory`], [`Error::Vulkan`] when the window is gone, and for a new size
    /// while an image of an earlier frame is kept: with it lives the old swapchain, and a window has one.
    pub fn present(
        &mut self,
        size: [u32; 2],
        mut record: impl FnMut(&mut Recorder, [u32; 2]) -> Result<()>,
        mut finish: impl FnMut(&mut Pass<'_>, &Image) -> Result<()>,
    ) -> Result<Presented> {
        for _ in 0..ATTEMPTS {
            if !self.make_ready(size)? {
                return Ok(Presented::Skipped);
            }
            let Some(swapchain) = &self.swapchain else {
                return Ok(Presented::Skipped);
            };
            // SAFETY: the semaphore is idle: the submission that waited for it before has been waited for.
            let acquired = unsafe {
                self.swapchains
                    .acquire_next_image(swapchain.inner.raw, u64::MAX, self.acquired, vk::Fence::null())
            };
            let index = match acquired {
                Ok((index, _)) => index,
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                    self.retire();
                    continue;
                }
                Err(result) => return Err(self.gpu().error("vkAcquireNextImageKHR", result)),
            };
            let (image, rendered) = swapchain.images[index as usize].clone();
            let (raw, drawn_size) = (swapchain.inner.raw, swapchain.inner.size);
            let timings = self.draw(&image, rendered, drawn_size, &mut record, &mut finish);
            let timings = match timings {
                Ok(timings) => timings,
                Err(error) => {
                    self.abandon();
                    return Err(error);
                }
            };
            let (waits, chains, indices) = ([rendered], [raw], [index]);
            let info = vk::PresentInfoKHR::default()
                .wait_semaphores(&waits)
                .swapchains(&chains)
                .image_indices(&indices);
            let queue = self.gpu().lock_queue();
            // SAFETY: the image was acquired and is in the layout for presenting; the queue is locked.
            let shown = unsafe { self.swapchains.queue_present(queue.raw, &info) };
            drop(queue);
            match shown {
                Ok(false) => {}
                // Shown, but the next frame wants a new swapchain.
                Ok(true) | Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => self.retire(),
                Err(result) => return Err(self.gpu().error("vkQueuePresentKHR", result)),
            }
            return Ok(Presented::Shown(timings));
        }
        Ok(Presented::Skipped)
    }

    fn draw(
        &self,
        image: &Image,
        rendered: vk::Semaphore,
        size: [u32; 2],
        record: &mut impl FnMut(&mut Recorder, [u32; 2]) -> Result<()>,
        finish: &mut impl FnMut(&mut Pass<'_>, &Image) -> Result<()>,
    ) -> Result<Timings> {
        let mut recorder = self.handle.recorder("frame")?;
        record(&mut recorder, size)?;
        recorder.pass("to the window", |pass| {
            pass.image_barrier(&[ImageBarrier {
                image,
                from: Access::TRANSFER,
                to: Access::TRANSFER_WRITE,
                old_layout: vk::ImageLayout::UNDEFINED,
                new_layout: vk::ImageLayout::TRANSFER_DST_OPTIMAL,
            }]);
            finish(pass, image)?;
            pass.image_barrier(&[ImageBarrier {
                image,
                from: Access::TRANSFER_WRITE,
                to: Access::NONE,
                old_layout: vk::ImageLayout::TRANSFER_DST_OPTIMAL,
                new_layout: vk::ImageLayout::PRESENT_SRC_KHR,
            }]);
            Ok(())
        })?;
        // SAFETY: the swapchain signals the one, and the other is free: its last presentation came before that of this image. The submission is
        // waited for.
        unsafe { recorder.submit_with(&[self.acquired], &[rendered]) }?.wait()
    }

    /// Makes a swapchain when there is none of that size. False when the window has no area.
    fn make_ready(&mut self, wanted: [u32; 2]) -> Result<bool> {
        // SAFETY: surface and physical device belong to one instance.
        let limits = unsafe {
            self.inner
                .loader
                .get_physical_device_surface_capabilities(self.gpu().physical_device, self.inner.raw)
        }
        .map_err(|result| self.gpu().error("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", result))?;
        let fixed = limits.current_extent.width != u32::MAX;
        let size = if fixed {
            [limits.current_extent.width, limits.current_extent.height]
        } else {
            let (low, high) = (limits.min_image_extent, limits.max_image_extent);
            [
                wanted[0].clamp(low.width, high.width),
                wanted[1].clamp(low.height, high.height),
            ]
        };
        if size.contains(&0) {
            return Ok(false);
        }
        if self.acquired == vk::Semaphore::null() {
            self.acquired = semaphore(self.gpu(), "image acquired")?;
        }
        if self
            .swapchain
            .as_ref()
            .is_some_and(|swapchain| swapchain.inner.size == size)
        {
            return Ok(true);
        }
        if !limits.supported_usage_flags.contains(vk::ImageUsageFlags::TRANSFER_DST) {
            return Err(Error::MissingFeature {
                feature: "copies to swapchain images".into(),
                needed_by: "presenting to a window".into(),
                device: self.gpu().caps.device.clone(),
                instead: "render headless".into(),
            });
        }
        self.retire();
        let most = if limits.max_image_count == 0 {
            u32::MAX
        } else {
            limits.max_image_count
        };
        // The attachment use, which every surface has, lets the images have views.
        let usage = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(self.inner.raw)
            .min_image_count((limits.min_image_count + 1).min(most))
            .image_format(self.format.format)
            .image_color_space(self.format.color_space)
            .image_extent(vk::Extent2D {
                width: size[0],
                height: size[1],
            })
            .image_array_layers(1)
            .image_usage(usage)
            .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
            .pre_transform(limits.current_transform)
            .composite_alpha(opaque(limits.supported_composite_alpha))
            .present_mode(vk::PresentModeKHR::FIFO)
            .clipped(true);
        let gpu = Arc::clone(self.gpu());
        // SAFETY: the surface is alive; where a kept image keeps its last swapchain, the window system says so.
        let raw = unsafe { self.swapchains.create_swapchain(&info, None) }
            .map_err(|result| gpu.error("vkCreateSwapchainKHR", result))?;
        let inner = Arc::new(SwapchainInner {
            surface: Arc::clone(&self.inner),
            device: self.swapchains.clone(),
            raw,
            size,
            format: self.format.format,
            usage,
        });
        let swapchain = self.swapchain.insert(Swapchain {
            inner: Arc::clone(&inner),
            images: Vec::new(),
        });
        // SAFETY: the swapchain was just made.
        let images = unsafe { self.swapchains.get_swapchain_images(raw) }
            .map_err(|result| gpu.error("vkGetSwapchainImagesKHR", result))?;
        for image in images {
            let image = Image {
                inner: Arc::new(ImageInner::of_swapchain(image, &inner)?),
            };
            let rendered = semaphore(&gpu, "image rendered")?;
            swapchain.images.push((image, rendered));
        }
        Ok(true)
    }

    /// After a frame that failed between acquiring and presenting: the semaphore may be left signalled, so both are given up.
    fn abandon(&mut self) {
        self.retire();
        // SAFETY: `retire` waited for the queue.
        unsafe { self.gpu().device.destroy_semaphore(self.acquired, None) };
        self.acquired = vk::Semaphore::null();
    }

    /// Gives the swapchain up once the queue is done with it. It goes with its last image.
    fn retire(&mut self) {
        let Some(swapchain) = self.swapchain.take() else {
            return;
        };
        self.gpu().wait_for_queue();
        for (_, rendered) in &swapchain.images {
            // SAFETY: the queue is idle, so no presentation waits for the semaphore.
            unsafe { self.gpu().device.destroy_semaphore(*rendered, None) };
        }
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        self.retire();
        // SAFETY: the queue is idle, or never had work of this surface's.
        unsafe { self.gpu().device.destroy_semaphore(self.acquired, None) };
    }
}

fn semaphore(gpu: &Inner, name: &str) -> Result<vk::Semaphore> {
    // SAFETY: plain creation; destroyed by the owner.
    let raw = unsafe { gpu.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
        .map_err(|result| gpu.error("vkCreateSemaphore", result))?;
    gpu.name(raw, name);
    Ok(raw)
}

fn opaque(supported: vk::CompositeAlphaFlagsKHR) -> vk::CompositeAlphaFlagsKHR {
    [
        vk::CompositeAlphaFlagsKHR::OPAQUE,
        vk::CompositeAlphaFlagsKHR::INHERIT,
        vk::CompositeAlphaFlagsKHR::PRE_MULTIPLIED,
    ]
    .into_iter()
    .find(|mode| supported.contains(*mode))
    .unwrap_or(vk::CompositeAlphaFlagsKHR::POST_MULTIPLIED)
}
