use super::print;
use crate::error::Result;
use crate::estimator::choice::DeviceRequest;
use crate::estimator::vulkan::{DeviceInfo, devices};
use comfy_table::{ContentArrangement, Table, TableStyle};

/// Lists the devices that can render.
#[derive(clap::Args)]
pub struct Devices {
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
}

impl Devices {
    pub(super) fn execute(self) -> Result<()> {
        let found = devices();
        if self.json {
            let list = found.unwrap_or_else(|e| {
                eprintln!("rootn: {e}");
                Vec::new()
            });
            return print(&(serde_json::to_string_pretty(&list).expect("plain data") + "\n"));
        }
        print(&match found {
            Ok(list) => table(&list),
            Err(e) => format!("{e}\n"),
        })?;
        let chosen = DeviceRequest::Auto.take()?;
        print(&format!("\n--device auto takes {}, because {}\n", chosen.name, chosen.reason))
    }
}

fn table(list: &[DeviceInfo]) -> String {
    let mut table = Table::new();
    table.load_style(TableStyle::new()).set_content_arrangement(ContentArrangement::Disabled);
    let yes = |there: bool| if there { "yes" } else { "no" }.to_owned();
    let mut row = |name: &str, value: &dyn Fn(&DeviceInfo) -> String| {
        let mut cells = vec![name.to_owned()];
        cells.extend(list.iter().map(value));
        table.add_row(cells);
    };
    row("--device", &|d| format!("vulkan:{}", d.index));
    row("name", &|d| d.name.clone());
    row("kind", &|d| d.kind.label().into());
    row("driver", &|d| d.driver.clone());
    row("Vulkan", &|d| d.api.clone());
    row("memory", &|d| bytes(d.memory));
    row("largest allocation", &|d| bytes(d.max_allocation));
    row("largest storage buffer", &|d| bytes(d.max_storage_buffer));
    row("timestamps", &|d| d.timestamp_period.map_or("no".into(), |p| format!("{p} ns, {} bits", d.timestamp_bits)));
    row("f64 in shaders", &|d| yes(d.float64));
    row("ray queries", &|d| yes(d.ray_query));
    row("ray-tracing pipelines", &|d| yes(d.ray_pipeline));
    row("can render", &|d| {
        if d.missing.is_empty() { "yes".into() } else { format!("no: lacks {}", d.missing.join(", ")) }
    });
    table.to_string().lines().map(|l| format!("{}\n", l.trim_end())).collect()
}

/// In powers of 1024.
fn bytes(n: u64) -> String {
    if n >= 1 << 30 { format!("{:.1} GiB", n as f64 / f64::from(1 << 30)) } else { format!("{} MiB", n >> 20) }
}
