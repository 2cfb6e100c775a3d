//! Mesa's Vulkan driver for AMD's GPUs, as a compiler that counts instructions.

use anyhow::{Context, Result, bail};
use ash::vk;
use naga::proc::BoundsCheckPolicy;
use naga::{AddressSpace, Binding, Module, ScalarKind, ShaderStage, TypeInner, VectorSize};
use std::collections::BTreeMap;
use std::ffi::CStr;

/// The name of the statistic that is reported.
const INSTRUCTIONS: &CStr = c"Instructions";

const VERTEX: &CStr = c"mesh_vertex";
const FRAGMENT: &CStr = c"mesh_frame";

/// A Vulkan device that need not exist: the driver compiles for it, and nothing is submitted.
pub(crate) struct Compiler {
    // The library must stay loaded as long as the device is used.
    _entry: ash::Entry,
    name: String,
    device: ash::Device,
    statistics: ash::khr::pipeline_executable_properties::Device,
}

impl Compiler {
    /// Opens the first device that reports statistics of compiled shaders.
    pub(crate) fn open() -> Result<Self> {
        const HINT: &str = "set RADV_FORCE_FAMILY and VK_ICD_FILENAMES, as CONTRIBUTING.md says";
        let extension = ash::khr::pipeline_executable_properties::NAME;
        // SAFETY: the loaded library is Vulkan's, and everything that the calls get is alive.
        unsafe {
            let entry = ash::Entry::load().context("loading Vulkan: install libvulkan1")?;
            let app = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let info = vk::InstanceCreateInfo::default().application_info(&app);
            let instance = entry.create_instance(&info, None).context(HINT)?;
            let devices = instance.enumerate_physical_devices().context(HINT)?;
            let reports = |&device: &vk::PhysicalDevice| {
                let extensions = instance.enumerate_device_extension_properties(device);
                let is_this =
                    |e: &vk::ExtensionProperties| e.extension_name_as_c_str() == Ok(extension);
                extensions.is_ok_and(|all| all.iter().any(is_this))
            };
            let physical = devices.into_iter().find(reports).context(HINT)?;
            let properties = instance.get_physical_device_properties(physical);
            let name = properties.device_name_as_c_str()?.to_string_lossy().into_owned();
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&[1.0])];
            let extensions = [extension.as_ptr()];
            let mut executables =
                vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
                    .pipeline_executable_info(true);
            let mut vulkan13 = vk::PhysicalDeviceVulkan13Features::default()
                .dynamic_rendering(true)
                .shader_demote_to_helper_invocation(true);
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&extensions)
                .push_next(&mut executables)
                .push_next(&mut vulkan13);
            let device = instance.create_device(physical, &info, None).context(HINT)?;
            let statistics =
                ash::khr::pipeline_executable_properties::Device::new(&instance, &device);
            Ok(Self { _entry: entry, name, device, statistics })
        }
    }

    /// The name of the device.
    pub(crate) fn device(&self) -> &str {
        &self.name
    }

    /// The number of instructions of the fragment shader of frames in a WGSL text.
    pub(crate) fn instructions(&self, wgsl: &str) -> Result<u64> {
        let module = naga::front::wgsl::parse_str(wgsl)
            .map_err(|e| anyhow::anyhow!("{}", e.emit_to_string(wgsl)))?;
        let code = spirv(&module)?;
        let pipeline = self.pipeline(&module, &code)?;
        let info = vk::PipelineInfoKHR::default().pipeline(pipeline);
        // SAFETY: the pipeline is the device's, and was made to report statistics.
        let executables = unsafe { self.statistics.get_pipeline_executable_properties(&info)? };
        let is_fragment = |e: &vk::PipelineExecutablePropertiesKHR<'_>| {
            e.stages.contains(vk::ShaderStageFlags::FRAGMENT)
        };
        let index = executables.iter().position(is_fragment).context("no fragment shader")?;
        let info = vk::PipelineExecutableInfoKHR::default()
            .pipeline(pipeline)
            .executable_index(index as u32);
        // SAFETY: as above, and the index is that of an executable of the pipeline.
        let all = unsafe { self.statistics.get_pipeline_executable_statistics(&info)? };
        let is_count = |s: &&vk::PipelineExecutableStatisticKHR<'_>| {
            s.name_as_c_str() == Ok(INSTRUCTIONS)
                && s.format == vk::PipelineExecutableStatisticFormatKHR::UINT64
        };
        let count = all.iter().find(is_count).context("the driver counts no instructions")?;
        // SAFETY: the statistic's format says that this is its member.
        Ok(unsafe { count.value.u64 })
    }

    fn pipeline(&self, module: &Module, code: &[u32]) -> Result<vk::Pipeline> {
        let inputs = vertex_inputs(module)?;
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        // SAFETY: all that the infos point to lives until the end of the function, and the objects
        // belong to this device. They stay alive as long as the process, which makes few.
        unsafe {
            let info = vk::ShaderModuleCreateInfo::default().code(code);
            let shader = self.device.create_shader_module(&info, None)?;
            let mut sets = Vec::new();
            for bindings in descriptor_sets(module)? {
                let bindings: Vec<_> = bindings
                    .into_iter()
                    .map(|(binding, ty)| {
                        vk::DescriptorSetLayoutBinding::default()
                            .binding(binding)
                            .descriptor_type(ty)
                            .descriptor_count(1)
                            .stage_flags(stages)
                    })
                    .collect();
                let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
                sets.push(self.device.create_descriptor_set_layout(&info, None)?);
            }
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            let layout = self.device.create_pipeline_layout(&info, None)?;
            let stage = |stage, name| {
                vk::PipelineShaderStageCreateInfo::default().stage(stage).module(shader).name(name)
            };
            let stages = [
                stage(vk::ShaderStageFlags::VERTEX, VERTEX),
                stage(vk::ShaderStageFlags::FRAGMENT, FRAGMENT),
            ];
            let buffers = [vk::VertexInputBindingDescription {
                binding: 0,
                stride: 16,
                ..Default::default()
            }];
            let input = vk::PipelineVertexInputStateCreateInfo::default()
                .vertex_binding_descriptions(&buffers)
                .vertex_attribute_descriptions(&inputs);
            let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
                .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
            let viewports = [vk::Viewport {
                width: 1920.0,
                height: 1080.0,
                max_depth: 1.0,
                ..Default::default()
            }];
            let scissors = [vk::Rect2D {
                extent: vk::Extent2D { width: 1920, height: 1080 },
                ..Default::default()
            }];
            let viewport = vk::PipelineViewportStateCreateInfo::default()
                .viewports(&viewports)
                .scissors(&scissors);
            let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
            let samples = vk::PipelineMultisampleStateCreateInfo::default()
                .rasterization_samples(vk::SampleCountFlags::TYPE_1);
            let depth = vk::PipelineDepthStencilStateCreateInfo::default()
                .depth_test_enable(true)
                .depth_write_enable(true)
                .depth_compare_op(vk::CompareOp::GREATER);
            let targets = [vk::PipelineColorBlendAttachmentState::default()
                .color_write_mask(vk::ColorComponentFlags::RGBA)];
            let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&targets);
            let formats = [vk::Format::R8G8B8A8_SRGB];
            let mut rendering = vk::PipelineRenderingCreateInfo::default()
                .color_attachment_formats(&formats)
                .depth_attachment_format(vk::Format::D32_SFLOAT);
            let info = vk::GraphicsPipelineCreateInfo::default()
                .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
                .stages(&stages)
                .vertex_input_state(&input)
                .input_assembly_state(&assembly)
                .viewport_state(&viewport)
                .rasterization_state(&raster)
                .multisample_state(&samples)
                .depth_stencil_state(&depth)
                .color_blend_state(&blend)
                .layout(layout)
                .push_next(&mut rendering);
            let pipelines =
                self.device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
            match pipelines {
                Ok(pipelines) => pipelines.first().copied().context("no pipeline"),
                Err((_, error)) => Err(error).context("making the pipeline"),
            }
        }
    }
}

/// SPIR-V as wgpu makes it, with its bounds of loops and of indices.
fn spirv(module: &Module) -> Result<Vec<u32>> {
    let capabilities = naga::valid::Capabilities::all();
    let info = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities)
        .validate(module)?;
    let mut options = naga::back::spv::Options { lang_version: (1, 3), ..Default::default() };
    options.bounds_check_policies.index = BoundsCheckPolicy::Restrict;
    options.force_loop_bounding = true;
    Ok(naga::back::spv::write_vec(module, &info, &options, None)?)
}

/// The types of a module's bindings, by group.
fn descriptor_sets(module: &Module) -> Result<Vec<BTreeMap<u32, vk::DescriptorType>>> {
    let mut sets: Vec<BTreeMap<_, _>> = Vec::new();
    for (_, global) in module.global_variables.iter() {
        let Some(at) = &global.binding else { continue };
        let ty = match (global.space, &module.types[global.ty].inner) {
            (AddressSpace::Uniform, _) => vk::DescriptorType::UNIFORM_BUFFER,
            (AddressSpace::Storage { .. }, _) => vk::DescriptorType::STORAGE_BUFFER,
            (_, TypeInner::Image { .. }) => vk::DescriptorType::SAMPLED_IMAGE,
            (_, TypeInner::Sampler { .. }) => vk::DescriptorType::SAMPLER,
            _ => bail!("the binding {at:?} is neither buffer, texture nor sampler"),
        };
        let group = at.group as usize;
        sets.resize_with(sets.len().max(group + 1), BTreeMap::new);
        sets[group].insert(at.binding, ty);
    }
    Ok(sets)
}

/// The inputs of the vertex shader, all in one buffer. The fragment shader does not depend on where
/// they lie.
fn vertex_inputs(module: &Module) -> Result<Vec<vk::VertexInputAttributeDescription>> {
    let is_vertex = |e: &&naga::EntryPoint| {
        e.stage == ShaderStage::Vertex && Ok(e.name.as_str()) == VERTEX.to_str()
    };
    let entry = module.entry_points.iter().find(is_vertex).context("no vertex shader")?;
    let mut inputs = Vec::new();
    for argument in &entry.function.arguments {
        let TypeInner::Struct { members, .. } = &module.types[argument.ty].inner else {
            bail!("the vertex shader takes something else than a struct")
        };
        for member in members {
            let Some(Binding::Location { location, .. }) = member.binding else { continue };
            let format = match module.types[member.ty].inner {
                TypeInner::Vector { size, scalar } if scalar.kind == ScalarKind::Float => {
                    match size {
                        VectorSize::Bi => vk::Format::R32G32_SFLOAT,
                        VectorSize::Tri => vk::Format::R32G32B32_SFLOAT,
                        VectorSize::Quad => vk::Format::R32G32B32A32_SFLOAT,
                    }
                }
                _ => bail!("input {location} of the vertex shader is no vector of floats"),
            };
            inputs.push(vk::VertexInputAttributeDescription {
                location,
                format,
                ..Default::default()
            });
        }
    }
    Ok(inputs)
}
