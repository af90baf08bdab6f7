//! Records of virtual lights on the host (`virtual_light.glsl`).

use glam::Vec3;

use crate::Result;
use crate::gpu::ash::vk;
use crate::gpu::shaders::constants::VIRTUAL_LIGHT_QUARTERS;
use crate::gpu::{Category, Gpu, TexelView};
use crate::techniques::instant_radiosity::VirtualLight;

/// Four quarters of a virtual light.
pub(super) struct LightRecord([[u32; 4]; VIRTUAL_LIGHT_QUARTERS as usize]);

impl LightRecord {
    /// Room for so many.
    pub fn texels(gpu: &Gpu, lights: u32) -> Result<TexelView> {
        let quarters = u64::from(lights) * u64::from(VIRTUAL_LIGHT_QUARTERS);
        gpu.storage_texels(
            "virtual lights",
            Category::Light,
            vk::Format::R32G32B32A32_UINT,
            quarters,
        )
    }

    /// The first `count` of a buffer. Waits for the device.
    pub fn read(gpu: &Gpu, records: &TexelView, count: u32) -> Result<Vec<Self>> {
        let quarters: Vec<[[u32; 4]; VIRTUAL_LIGHT_QUARTERS as usize]> =
            gpu.read(records.buffer().view(), count as usize)?;
        Ok(quarters.into_iter().map(Self).collect())
    }

    fn vector(&self, quarter: usize) -> Vec3 {
        Vec3::from_array([0, 1, 2].map(|i| f32::from_bits(self.0[quarter][i])))
    }

    /// Just off its surface.
    pub fn place(&self) -> Vec3 {
        self.vector(0) + f32::from_bits(self.0[1][3]) * self.vector(1)
    }

    /// What it is, one of so many.
    pub fn light(&self, of: u32) -> VirtualLight {
        VirtualLight {
            position: self.vector(0),
            normal: self.vector(1),
            power: self.vector(2) / of as f32,
            bounce: self.0[3][3],
        }
    }
}
