//! `umbrage devices` lists the GPUs and the features that shadow maps can use on each.

use crate::args::bench;
use crate::output::{aligned, print};
use anyhow::Result;
use serde::Serialize;
use umbrage_render::{AdapterReport, devices};

#[derive(Serialize)]
struct DeviceJson {
    name: String,
    backend: String,
    kind: String,
    driver: String,
    software: bool,
    /// The missing feature that shadow maps need; `null` if there is none.
    problem: Option<String>,
    /// Whether the GPU can clamp depths. Like the other fields below except `timestamps`, this is
    /// `null` if there is a problem.
    depth_clip_control: Option<bool>,
    storage_buffers: Option<bool>,
    depth_fetch: Option<bool>,
    max_side: Option<u32>,
    max_layers: Option<u32>,
    timestamps: bool,
}

impl From<AdapterReport> for DeviceJson {
    fn from(report: AdapterReport) -> Self {
        let software = report.is_software();
        let AdapterReport { info, support, has_timestamps } = report;
        let can = support.as_ref().ok();
        Self {
            name: info.name,
            backend: info.backend.to_string(),
            kind: format!("{:?}", info.device_type),
            driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
            software,
            problem: support.as_ref().err().map(ToString::to_string),
            depth_clip_control: can.map(|s| s.depth_clip_control),
            storage_buffers: can.map(|s| s.storage_buffers),
            depth_fetch: can.map(|s| s.depth_fetch),
            max_side: can.map(|s| s.max_side),
            max_layers: can.map(|s| s.max_layers),
            timestamps: has_timestamps,
        }
    }
}

/// Prints the list of GPUs, the best first.
pub(crate) fn run(args: &bench::Devices) -> Result<()> {
    let devices: Vec<DeviceJson> = devices().into_iter().map(DeviceJson::from).collect();
    if args.json {
        return print(&format!("{}\n", serde_json::to_string_pretty(&devices)?));
    }
    if devices.is_empty() {
        return print(
            "no GPU answers: install a driver for Vulkan, Metal or Direct3D 12 (in software, on Debian and its kin: \
             mesa-vulkan-drivers)\n",
        );
    }
    let heads = [
        "name",
        "backend",
        "kind",
        "depth clamping",
        "storage buffers",
        "depth fetches",
        "timestamps",
        "largest map",
        "",
    ];
    let yes = |b: Option<bool>| b.map_or("-", |b| if b { "yes" } else { "no" }).to_owned();
    let mut rows: Vec<Vec<String>> = vec![heads.map(str::to_owned).to_vec()];
    rows.extend(devices.into_iter().map(|d| {
        vec![
            d.name,
            d.backend,
            if d.software { "software".to_owned() } else { d.kind },
            yes(d.depth_clip_control),
            yes(d.storage_buffers),
            yes(d.depth_fetch),
            yes(Some(d.timestamps)),
            d.max_side.map_or("-".to_owned(), |n| format!("{n}x{n}")),
            d.problem.unwrap_or_default(),
        ]
    }));
    print(&aligned(&rows))
}
