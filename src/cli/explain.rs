use super::print;
use super::render::Reading;
use crate::error::{Error, Result};
use crate::estimator::cpu::{CpuEstimator, PreparedScene};
use crate::estimator::{Cell, Estimator};
use crate::record::write_atomically;
use crate::report::{picture, plain};
use crate::sampling::strategy::{LightChoice, Lights, Preset};
use crate::sampling::{Key, Role};
use crate::scene::inventory::{Bytes, Count, Counts, causes, sampled_by_area};
use crate::scene::light::LightSampler;
use crate::scene::{Depth, Effects};
use crate::stats::number::significant;
use crate::transport::heckbert::{PathClass, path_classes};
use comfy_table::{ContentArrangement, Table, TableStyle};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Says what scenes call for and because of what, what is left out, which paths there may be, and what it takes to hold them.
/// Of several scenes: a row for each.
#[derive(clap::Args)]
pub struct Explain {
    /// Scene files (Mitsuba 3 XML).
    #[arg(required = true)]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    reading: Reading,
    /// Print JSON; of several scenes a list.
    #[arg(long)]
    json: bool,
    /// Render the scene on the CPU with 16 samples per pixel and write it as PNG.
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,
}

/// Samples per pixel of pictures.
const PICTURE_SPP: u64 = 16;
/// Columns of the output.
const WIDTH: u16 = 96;
/// Objects that are named before the rest is counted.
const NAMED: usize = 3;

/// What is said of a scene.
#[derive(Serialize)]
struct Explanation {
    name: String,
    file: PathBuf,
    film: [u32; 2],
    max_depth: Option<u32>,
    /// Depth from which roulette may end paths.
    roulette_depth: Option<u32>,
    effects: Vec<CalledFor>,
    left_out: Vec<&'static str>,
    /// Which variant of the kernels a GPU takes: the one without rare effects or the one with all.
    kernel: &'static str,
    /// Which code the CPU takes: that for diffuse scenes or that for all.
    cpu: &'static str,
    paths: Vec<PathClass>,
    counts: Counts,
    bytes: Bytes,
    bvh_bytes: usize,
    seconds: Seconds,
    /// Lights that solid-angle sampling draws by area.
    sampled_by_area: Vec<String>,
    warnings: Vec<String>,
}

/// An effect and the objects that call for it.
#[derive(Serialize)]
struct CalledFor {
    effect: &'static str,
    because_of: Vec<String>,
}

#[derive(Serialize)]
struct Seconds {
    /// Of reading files.
    load: f64,
    /// Of checks and the hash.
    check: f64,
    bvh: f64,
}

impl Explain {
    pub(super) fn execute(self) -> Result<()> {
        if let [scene] = &self.scenes[..] {
            let (explanation, prepared) = self.explain(scene)?;
            if let Some(path) = &self.picture {
                write_picture(prepared, path)?;
            }
            return print(&if self.json { json(&explanation) } else { explanation.text() });
        }
        if self.picture.is_some() {
            return Err(Error::Usage("--picture is for one scene".into()));
        }
        let all: Vec<Result<Explanation>> =
            self.scenes.iter().map(|scene| self.explain(scene).map(|(explanation, _)| explanation)).collect();
        print(&if self.json { json_list(&self.scenes, &all) } else { table_of_scenes(&self.scenes, &all) })?;
        all.into_iter().find_map(Result::err).map_or(Ok(()), Err)
    }

    fn explain(&self, file: &Path) -> Result<(Explanation, Arc<PreparedScene>)> {
        let start = Instant::now();
        let scene = self.reading.load(file)?;
        let load = start.elapsed().as_secs_f64();
        let prepared = Arc::new(PreparedScene::new(scene)?);
        let scene = &prepared.scene;
        // The strategies that sample lights agree on whether there are any.
        let samples_lights = !LightSampler::new(scene, Lights::Area, LightChoice::Power).is_empty();
        let effects = Effects::of(scene, samples_lights);
        let called =
            causes(scene, samples_lights).into_iter().map(|c| CalledFor { effect: c.name, because_of: c.objects });
        let Depth { max, roulette } = scene.depth;
        let explanation = Explanation {
            name: scene.name.clone(),
            file: file.to_owned(),
            film: scene.film.crop_size,
            max_depth: max,
            roulette_depth: (roulette < u32::MAX).then_some(roulette),
            effects: called.collect(),
            left_out: effects.left_out().names().collect(),
            kernel: if Effects::SHORT.contains(effects) { "short" } else { "full" },
            cpu: if Effects::of_materials(scene).are_diffuse() { "diffuse" } else { "general" },
            paths: path_classes(scene),
            counts: Counts::of(scene),
            bytes: Bytes::of(scene),
            bvh_bytes: prepared.bvh().bytes(),
            seconds: Seconds { load, check: prepared.setup_seconds, bvh: prepared.bvh_seconds() },
            sampled_by_area: sampled_by_area(scene).iter().map(|s| s.name.clone()).collect(),
            warnings: scene.warnings.clone(),
        };
        Ok((explanation, prepared))
    }
}

fn write_picture(prepared: Arc<PreparedScene>, path: &Path) -> Result<()> {
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return Err(Error::Usage(format!("--picture {}: only .png pictures are written", path.display())));
    }
    let strategy = Preset::Mis.strategy();
    let estimator = CpuEstimator::new(prepared, strategy);
    let cell = Cell { key: Key::new(1, Role::Run, &strategy.identity(), 0), length: PICTURE_SPP };
    let estimate = estimator.estimate(&cell, PICTURE_SPP, &mut None)?;
    let rgb: Vec<f32> = estimate.field.iter().map(|&v| v as f32).collect();
    let shape = estimator.shape();
    write_atomically(path, &picture(shape.width, shape.height, &rgb))
}

fn json(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("plain data") + "\n"
}

fn json_list(files: &[PathBuf], all: &[Result<Explanation>]) -> String {
    let entry = |(file, outcome): (&PathBuf, &Result<Explanation>)| match outcome {
        Ok(explanation) => serde_json::to_value(explanation).expect("plain data"),
        Err(e) => serde_json::json!({ "file": file, "error": e.to_string() }),
    };
    json(&files.iter().zip(all).map(entry).collect::<Vec<_>>())
}

fn table_of_scenes(files: &[PathBuf], all: &[Result<Explanation>]) -> String {
    let mut rows = vec![["scene", "triangles", "lights", "textures", "effects"].map(str::to_owned)];
    for (file, outcome) in files.iter().zip(all) {
        rows.push(match outcome {
            Ok(e) => [
                e.name.clone(),
                e.counts.triangles.to_string(),
                sum(&e.counts.lights).to_string(),
                sum(&e.counts.textures).to_string(),
                e.effects.iter().map(|c| c.effect).collect::<Vec<_>>().join(", "),
            ],
            Err(e) => {
                let name = file.file_stem().unwrap_or(file.as_os_str()).to_string_lossy().into_owned();
                [name, String::new(), String::new(), String::new(), format!("error: {e}")]
            }
        });
    }
    table(rows)
}

/// Columns without lines between them, wrapped to [`WIDTH`].
fn table<const N: usize>(rows: impl IntoIterator<Item = [String; N]>) -> String {
    let mut table = Table::new();
    table.load_style(TableStyle::new()).set_content_arrangement(ContentArrangement::Dynamic).set_width(WIDTH);
    for row in rows {
        table.add_row(row.map(|cell| plain(&cell)));
    }
    table.to_string().lines().map(|l| format!("{}\n", l.trim_end())).collect()
}

fn sum(counts: &[Count]) -> usize {
    counts.iter().map(|c| c.count).sum()
}

/// "8: 6 rectangle, 2 mesh", or "none".
fn kinds(counts: &[Count]) -> String {
    if counts.is_empty() {
        return "none".into();
    }
    let each = counts.iter().map(|c| format!("{} {}", c.count, c.kind)).collect::<Vec<_>>().join(", ");
    format!("{}: {each}", sum(counts))
}

/// In powers of 1024.
fn bytes(n: usize) -> String {
    let units = ["bytes", "KiB", "MiB", "GiB"];
    let power = (0..3).take_while(|p| n >> (10 * (p + 1)) > 0).count();
    if power == 0 {
        format!("{n} bytes")
    } else {
        format!("{} {}", significant(n as f64 / 1024f64.powi(power as i32), 3), units[power])
    }
}

impl Explanation {
    /// For people.
    fn text(&self) -> String {
        let row = |name: &str, value: String| [name.to_owned(), value];
        let [width, height] = self.film;
        let longest = self.max_depth.map_or_else(|| "any number of".into(), |d| format!("at most {d}"));
        let roulette = match self.roulette_depth {
            None => "no roulette".to_owned(),
            Some(depth) => format!("roulette from depth {depth}"),
        };
        let mut text = format!("{}\n", plain(&format!("{} ({})", self.name, self.file.display())));
        text += &format!("{width} × {height} pixels, paths of {longest} edges, {roulette}\n");
        let mut section = |heading: &str, body: String| text += &format!("\n{heading}\n{body}");
        section("Called for", table(self.effects.iter().map(|c| row(c.effect, self.named(&c.because_of)))));
        let gpu = match self.kernel {
            "short" => "by a short kernel that lacks the rarer ones",
            _ => "by constants in the kernel that has all",
        };
        let cpu = match self.cpu {
            "diffuse" => "by code for diffuse materials alone",
            _ => "nothing by itself: materials are of several kinds",
        };
        let left_out = if self.left_out.is_empty() { "nothing".into() } else { self.left_out.join(", ") };
        section("Left out", table([row("effects", left_out), row("GPU", gpu.into()), row("CPU", cpu.into())]));
        let paths = self.paths.iter().map(|c| [c.expression, c.meaning, c.found.label()].map(str::to_owned));
        let head = ["class", "paths", "found by"].map(str::to_owned);
        let heading = "Paths there may be (L light, D diffuse or rough, S specular, E eye: Heckbert 1990)";
        section(heading, table(std::iter::once(head).chain(paths)));
        section("Objects", table(self.objects()));
        section("Memory", table(self.memory()));
        let Seconds { load, check, bvh } = self.seconds;
        let seconds = |s: f64| format!("{} s", significant(s, 2));
        section(
            "Time",
            table([row("reading", seconds(load)), row("checks", seconds(check)), row("BVH", seconds(bvh))]),
        );
        if !self.sampled_by_area.is_empty() {
            let lights = format!("  {} (disk, cylinder or inward sphere)\n", plain(&self.named(&self.sampled_by_area)));
            section("Lights that solid-angle sampling draws by area", lights);
        }
        if !self.warnings.is_empty() {
            section("Warnings", table(self.warnings.iter().map(|w| [w.clone()])));
        }
        text
    }

    /// "floor, ceiling, back and 5 more".
    fn named(&self, names: &[String]) -> String {
        // Objects without a name of their own are named by their place, mostly in this file.
        let here = format!("({}:", self.file.display());
        let first = names.iter().take(NAMED).map(|n| n.replace(&here, "(line ")).collect::<Vec<_>>().join(", ");
        match names.len().saturating_sub(NAMED) {
            0 => first,
            more => format!("{first} and {more} more"),
        }
    }

    fn objects(&self) -> Vec<[String; 2]> {
        let c = &self.counts;
        let textures = match c.texels {
            0 => kinds(&c.textures),
            texels => format!("{}; {texels} texels", kinds(&c.textures)),
        };
        let mut rows = vec![
            ["triangles".to_owned(), format!("{} over {} vertices", c.triangles, c.vertices)],
            ["shapes".to_owned(), kinds(&c.shapes)],
            ["lights".to_owned(), kinds(&c.lights)],
            ["materials".to_owned(), kinds(&c.materials)],
            ["textures".to_owned(), textures],
        ];
        if c.environment_texels > 0 {
            rows.push(["environment map".to_owned(), format!("{} texels", c.environment_texels)]);
        }
        rows
    }

    fn memory(&self) -> Vec<[String; 2]> {
        let b = &self.bytes;
        let per_triangle = match self.counts.triangles {
            0 => String::new(),
            n => format!(", {} bytes per triangle", significant(self.bvh_bytes as f64 / n as f64, 3)),
        };
        let parts = [
            ("triangles", b.triangles, ""),
            ("other objects", b.objects, ""),
            ("textures", b.textures, ""),
            ("environment map", b.environment_map, ""),
            ("BVH", self.bvh_bytes, &per_triangle),
            ("all", b.total() + self.bvh_bytes, ""),
        ];
        let row = |(name, n, more): (&str, usize, &str)| [name.to_owned(), format!("{}{more}", bytes(n))];
        parts.into_iter().filter(|p| p.1 > 0).map(row).collect()
    }
}
