//! The command as its users see it: exit codes, what goes to stdout, files.

use crate::determinism::{cornell, experiment};
use rootn::record::image::{DEFINITIONS, read_exr};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// Runs a command that must end with this code, and gives stdout and stderr.
pub(crate) fn ends(folder: &Path, code: i32, arguments: &[&str]) -> (String, String) {
    ends_with(folder, code, &[], arguments)
}

/// The same with changed variables of the environment.
fn ends_with(folder: &Path, code: i32, variables: &[(&str, &Path)], arguments: &[&str]) -> (String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rootn"));
    command.current_dir(folder).args(arguments).env_remove("RUST_BACKTRACE").envs(variables.iter().copied());
    let out = command.output().unwrap();
    let (stdout, stderr) = (text(&out.stdout).to_owned(), text(&out.stderr).to_owned());
    assert_eq!(out.status.code(), Some(code), "{arguments:?}\n{stdout}\n{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    (stdout, stderr)
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

#[test]
fn exit_codes() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let scene = cornell();
    let scene = scene.to_str().unwrap();
    std::fs::write(here.join("bad.toml"), "name = \"x\"\n[budgte]\n").unwrap();
    std::fs::write(here.join("bad.xml"), "<scene>").unwrap();
    std::fs::create_dir(here.join("empty")).unwrap();
    std::fs::create_dir(here.join("damaged")).unwrap();
    std::fs::write(here.join("damaged/record.json"), "{\"format\": 1, \"name\": ").unwrap();
    std::fs::create_dir(here.join("old")).unwrap();
    std::fs::write(here.join("old/record.json"), "{}").unwrap();
    let render = ["render", scene, "-o", "x.exr", "--width", "2", "--height", "2", "--spp", "1", "--quiet"];
    let with = |more: &[&'static str]| [&render[..], more].concat();
    ends(here, 0, &["--help"]);
    ends(here, 0, &["--version"]);
    ends(here, 0, &render);
    let cases: &[(i32, Vec<&str>, &str)] = &[
        (2, vec![], "Usage"),
        (2, vec!["rnu"], "unrecognized"),
        (2, vec!["run"], "required"),
        (2, vec!["run", "bad.toml"], "bad.toml:2"),
        (2, vec!["render", "bad.xml", "-o", "x.exr"], "bad.xml"),
        (2, with(&["--spp", "0"]), ""),
        (2, with(&["--threads", "0"]), ""),
        (2, with(&["--threads", "4000000000"]), ""),
        (2, with(&["--strategy", "best"]), "mis"),
        (2, with(&["--max-depth", "-1"]), ""),
        (2, with(&["-D", "novalue"]), "NAME=VALUE"),
        (2, vec!["render", scene, "-o", "x.exr", "--width", "2"], "go together"),
        (2, vec!["render", scene, "-o", "x.exr", "--width", "0", "--height", "2"], "1 to 65536"),
        (2, vec!["render", scene, "-o", "x.exr", "--width", "65536", "--height", "65536"], "pixels; at most"),
        (2, vec!["replay", scene, "--pixel", "9999,0"], "outside the film"),
        (2, vec!["replay", scene, "--pixel", "1"], "expected X,Y"),
        (2, vec!["replay", scene, "--pixel", "1,1", "--strategy", "sobol", "--sample", "64"], "--spp 64"),
        (2, vec!["completions", "tcsh"], "bash"),
        (4, vec!["run", "none.toml"], "none.toml"),
        (4, vec!["render", "none.xml", "-o", "x.exr"], "none.xml"),
        (4, vec!["render", scene, "-o", "bad.toml/x.exr", "--width", "2", "--height", "2", "--spp", "1"], "bad.toml"),
        (4, vec!["report", "none"], "record.json"),
        (4, vec!["report", "empty"], "record.json"),
        (4, vec!["report", "damaged"], "not a record"),
        (4, vec!["report", "old"], "not a record"),
    ];
    for (code, arguments, said) in cases {
        let (stdout, stderr) = ends(here, *code, arguments);
        assert!(stderr.contains(said), "{arguments:?}: {stderr}");
        assert!(stdout.is_empty(), "{arguments:?}: {stdout}");
    }
}

#[test]
fn run_writes_what_it_promises() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let claim = "[[claim]]\ntext = \"MIS is finite\"\nkind = \"finite\"\nof = \"mis\"\n";
    experiment(here, &cornell(), 16, claim);
    let (stdout, stderr) = ends(here, 0, &["run", "small.toml"]);
    assert!(stdout.contains("√relMSE at N = ") && stdout.contains("MIS is finite"), "{stdout}");
    assert!(stderr.contains("checkpoints computed, 0 reused") && stderr.contains("report.html"), "{stderr}");
    assert!(!stdout.contains('\u{1b}') && !stderr.contains('\u{1b}'), "no colours into a pipe");
    let out = here.join("reports/small");
    for file in ["record.json", "curves.csv", "summary.md", "report.html"] {
        assert!(std::fs::metadata(out.join(file)).unwrap().len() > 100, "{file}");
    }
    let header = std::fs::read_to_string(out.join("curves.csv")).unwrap();
    assert_eq!(header.lines().next(), Some("scene,strategy,device,replicate,spp,seconds,metric,value,predicted"));
    // The same again: nothing is computed, and with --quiet nothing is said.
    let (again, stderr) = ends(here, 0, &["run", "small.toml"]);
    assert!(again == stdout && stderr.contains("0 checkpoints computed"), "{stderr}");
    let (quiet, stderr) = ends(here, 0, &["run", "small.toml", "--quiet"]);
    assert!(quiet == stdout && stderr.is_empty(), "{stderr}");
    let (reported, _) = ends(here, 0, &["report", "reports/small"]);
    assert_eq!(reported, stdout);
    // JSON on stdout is the record.
    let (json, _) = ends(here, 0, &["run", "small.toml", "--json"]);
    let printed: Value = serde_json::from_str(&json).unwrap();
    let kept: Value = serde_json::from_str(&std::fs::read_to_string(out.join("record.json")).unwrap()).unwrap();
    assert_eq!(printed, kept);
    assert_eq!(printed["claims"][0]["verdict"], "supported");
    // --fresh computes all again; --set and --out are heard.
    let (_, stderr) = ends(here, 0, &["run", "small.toml", "--fresh"]);
    assert!(stderr.contains(" 0 reused"), "{stderr}");
    let (json, _) = ends(
        here,
        0,
        &["run", "small.toml", "--json", "--set", "budget.spp=4", "--set", "name=other", "--out", "elsewhere"],
    );
    let printed: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(printed["scenes"][0]["strategies"][0]["checkpoints"].as_array().unwrap().len(), 3);
    assert!(here.join("elsewhere/other/record.json").exists());
    ends(here, 2, &["run", "small.toml", "--set", "budget.spp=0"]);
    // A damaged record.
    let mut record = std::fs::read(out.join("record.json")).unwrap();
    record.truncate(record.len() / 2);
    std::fs::write(out.join("record.json"), record).unwrap();
    let (_, stderr) = ends(here, 4, &["report", "reports/small"]);
    assert!(stderr.contains("record.json"), "{stderr}");
}

#[test]
fn schema_and_completions() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (schema, stderr) = ends(here, 0, &["schema"]);
    assert_eq!(schema, std::fs::read_to_string(here.join("experiments/experiment.schema.json")).unwrap());
    assert!(stderr.is_empty());
    let parsed: Value = serde_json::from_str(&schema).unwrap();
    assert_eq!(parsed["$schema"], "http://json-schema.org/draft-07/schema#");
    for key in ["name", "scene", "budget", "strategy", "claim", "reference"] {
        assert!(parsed["properties"][key].is_object(), "{key}");
    }
    for shell in ["bash", "zsh", "fish"] {
        let (script, stderr) = ends(here, 0, &["completions", shell]);
        assert!(script.contains("rootn") && script.contains("render") && stderr.is_empty());
    }
}

/// Renders the Cornell box in 6 × 5 pixels and reads the image back.
pub(crate) fn render(here: &Path, more: &[&str]) -> rootn::record::image::Layers {
    let scene = cornell();
    let fixed = ["render", scene.to_str().unwrap(), "-o", "out/image.exr", "--width", "6", "--height", "5"];
    let (stdout, stderr) = ends(here, 0, &[&fixed[..], more].concat());
    assert!(stdout.is_empty(), "{stdout}");
    assert_eq!(stderr.is_empty(), more.contains(&"--quiet"), "{stderr}");
    read_exr(&here.join("out/image.exr")).unwrap()
}

#[test]
fn render_writes_all_moments() {
    let folder = tempfile::tempdir().unwrap();
    let image = render(folder.path(), &["--spp", "32"]);
    assert_eq!((image.width, image.height), (6, 5));
    for layer in ["", "sample_variance", "std_error", "m3", "m4", "min", "max", "argmax", "non_finite", "zeros"] {
        assert_eq!(image.layer(layer).unwrap().0, 3, "{layer}");
        assert!(layer.is_empty() || DEFINITIONS.iter().any(|d| d.0 == layer), "{layer} is not defined");
    }
    assert_eq!(image.counts["n.Y"], [32; 30]);
    let of = |layer: &str| image.layer(layer).unwrap().1;
    let (mean, variance, error) = (of(""), of("sample_variance"), of("std_error"));
    let (least, most) = (of("min"), of("max"));
    assert!(mean.iter().any(|&v| v > 0.0));
    for i in 0..90 {
        assert!(least[i] <= mean[i] && mean[i] <= most[i] && variance[i] >= 0.0);
        assert!((error[i] - (variance[i] / 32.0).sqrt()).abs() <= 1e-6 * error[i]);
    }
    // Where one run cannot tell its error, it does not: one sample, and samples that depend on one another.
    let one = render(folder.path(), &["--spp", "1", "--quiet"]);
    assert!(one.layer("std_error").is_none() && one.layer("sample_variance").is_none());
    let sobol = render(folder.path(), &["--spp", "32", "--strategy", "sobol", "--quiet"]);
    assert!(sobol.layer("std_error").is_none() && sobol.layer("sample_variance").is_some());
    // The same command gives the same picture; another seed another one.
    assert_eq!(render(folder.path(), &["--spp", "32", "--threads", "1", "--quiet"]), image);
    assert_ne!(render(folder.path(), &["--spp", "32", "--seed", "2", "--quiet"]).layer(""), image.layer(""));
    let dark = render(folder.path(), &["--max-depth", "0", "--quiet"]);
    assert!(dark.layer("").unwrap().1.iter().all(|&v| v == 0.0));
}

#[test]
fn replay_explains_the_largest_samples() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let scene = cornell();
    let text = format!(
        "name = \"test\"\nfilm = {{ width = 6, height = 5 }}\n[[scene]]\nname = \"box\"\nfile = \"{}\"\n\
         [budget]\nspp = 16\nreplicates = 4\nseed = 3\n[reference]\nspp = 16\n\
         [[strategy]]\nname = \"directions\"\npreset = \"importance\"\n[[strategy]]\npreset = \"stratified\"\n\
         [[scene]]\nintegrand = \"disc\"\n",
        scene.display()
    );
    std::fs::write(here.join("test.toml"), text).unwrap();
    let (_, stderr) = ends(here, 4, &["replay", "test.toml", "--largest", "2"]);
    assert!(stderr.contains("record.json"), "{stderr}");
    ends(here, 0, &["run", "test.toml", "--quiet"]);
    let record = std::fs::read_to_string(here.join("reports/test/record.json")).unwrap();
    let record: Value = serde_json::from_str(&record).unwrap();
    for (i, strategy) in ["directions", "stratified"].into_iter().enumerate() {
        let named = &record["scenes"][0]["strategies"][i]["health"]["largest"];
        let arguments = ["replay", "test.toml", "--strategy", strategy, "--largest", "3"];
        let (json, _) = ends(here, 0, &[&arguments[..], &["--json"]].concat());
        let replayed: Value = serde_json::from_str(&json).unwrap();
        assert_eq!(replayed.as_array().unwrap().len(), 3);
        for (path, largest) in replayed.as_array().unwrap().iter().zip(named.as_array().unwrap()) {
            let channel = largest["channel"].as_u64().unwrap() as usize;
            assert_eq!(path["radiance"][channel].as_f64().unwrap(), largest["value"].as_f64().unwrap(), "{strategy}");
        }
        let (text, _) = ends(here, 0, &arguments);
        assert_eq!(text.matches(" of the variance\n").count(), 3, "{text}");
    }
    let other = std::fs::read_to_string(here.join("test.toml")).unwrap().replace("width = 6", "width = 7");
    std::fs::write(here.join("other.toml"), other).unwrap();
    let (_, stderr) = ends(here, 2, &["replay", "other.toml", "--largest", "2"]);
    assert!(stderr.contains("since the run, the scene or the experiment has changed"), "{stderr}");
    for (arguments, said) in [
        (
            &["--largest", "2", "--strategy", "nobody"][..],
            "no strategy is named `nobody` (there are directions, stratified)",
        ),
        (&["--largest", "2", "--scene", "nowhere"], "no scene is named `nowhere` (there are box, disc)"),
        (&["--largest", "2", "--scene", "disc"], "no rendered scene"),
        (&["--largest", "2", "--pixel", "1,1"], "cannot be used with"),
        (&["--pixel", "1,1", "--width", "9", "--height", "9"], "those of its file"),
        (&[], "--pixel"),
    ] {
        let (_, stderr) = ends(here, 2, &[&["replay", "test.toml"][..], arguments].concat());
        assert!(stderr.contains(said), "{stderr}");
    }
    let (_, stderr) = ends(here, 2, &["replay", scene.to_str().unwrap(), "--largest", "2"]);
    assert!(stderr.contains("for experiments"), "{stderr}");
}

#[test]
fn replay_gives_the_sample_that_render_took() {
    let folder = tempfile::tempdir().unwrap();
    let scene = cornell();
    let scene = scene.to_str().unwrap();
    let mut lit = 0;
    for strategy in ["uniform", "mis", "stratified", "sobol"] {
        let image = render(folder.path(), &["--spp", "1", "--strategy", strategy, "--seed", "5", "--quiet"]);
        let rendered = image.layer("").unwrap().1;
        for (x, y) in [(0, 0), (3, 2), (5, 4), (2, 0), (3, 0)] {
            let pixel = format!("{x},{y}");
            let fixed = ["replay", scene, "--pixel", &pixel, "--width", "6", "--height", "5", "--seed", "5"];
            let arguments = [&fixed[..], &["--strategy", strategy, "--spp", "1"]].concat();
            let (stdout, _) = ends(folder.path(), 0, &arguments);
            let last = stdout.lines().last().unwrap();
            let numbers = last.strip_prefix("radiance (").unwrap().trim_end_matches(')');
            let replayed: Vec<f32> = numbers.split(", ").map(|n| n.parse().unwrap()).collect();
            assert_eq!(replayed, rendered[3 * (6 * y + x)..][..3], "{strategy} {pixel}");
            lit += usize::from(replayed[0] > 0.0);
            let (json, _) = ends(folder.path(), 0, &[&arguments[..], &["--json"]].concat());
            let parsed: Value = serde_json::from_str(&json).unwrap();
            let radiance: Vec<f32> =
                parsed["radiance"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap() as f32).collect();
            assert_eq!(radiance, replayed);
            assert!(replayed[0] == 0.0 || !parsed["events"].as_array().unwrap().is_empty());
        }
    }
    assert!(lit >= 5, "nothing was compared");
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let script = format!("{} schema | head -n 1", env!("CARGO_BIN_EXE_rootn"));
    let out = Command::new("sh").current_dir(folder.path()).args(["-c", &script]).output().unwrap();
    assert!(text(&out.stderr).is_empty() && !out.stdout.is_empty(), "{}", text(&out.stderr));
}

/// Without a driver, and without a loader, what needs a GPU says why it cannot be had, and all else works.
#[cfg(feature = "vulkan")]
#[test]
fn without_vulkan() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let (scene, nothing) = (cornell(), here.join("nothing.json"));
    let scene = scene.to_str().unwrap();
    std::fs::write(here.join("libvulkan.so.1"), "not a library").unwrap();
    let no_driver = [("VK_DRIVER_FILES", &*nothing), ("VK_ICD_FILENAMES", &*nothing)];
    let no_loader = [("LD_LIBRARY_PATH", here)];
    let render = ["render", scene, "-o", "x.exr", "--width", "2", "--height", "2", "--spp", "1"];
    for variables in [&no_driver[..], &no_loader[..]] {
        let (_, stderr) = ends_with(here, 2, variables, &[&render[..], &["--device", "vulkan"]].concat());
        assert!(stderr.contains("is unavailable, because"), "{stderr}");
        let (_, stderr) = ends_with(here, 0, variables, &render);
        assert!(stderr.contains("device: cpu, because "), "{stderr}");
        let (stdout, _) = ends_with(here, 0, variables, &["devices"]);
        assert!(stdout.contains("unavailable") && stdout.contains("--device auto takes cpu"), "{stdout}");
        let (stdout, _) = ends_with(here, 0, variables, &["devices", "--json"]);
        assert_eq!(stdout, "[]\n");
    }
}

#[cfg(feature = "vulkan")]
#[test]
fn devices_are_chosen_and_named() {
    let Some(device) = crate::support::vulkan() else { return };
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let name = device.info().name.clone();
    let (stdout, _) = ends(here, 0, &["devices"]);
    assert!(stdout.contains(&name) && stdout.contains("vulkan:0"), "{stdout}");
    let (stdout, _) = ends(here, 0, &["devices", "--json"]);
    assert!(serde_json::from_str::<Value>(&stdout).unwrap()[0]["name"].is_string());
    let scene = cornell();
    let render = ["render", scene.to_str().unwrap(), "-o", "x.exr", "--width", "8", "--height", "8", "--spp", "4"];
    let with = |more: &[&'static str]| [&render[..], more].concat();
    for (arguments, message) in [
        (with(&["--device", "gpu"]), "vulkan:NAME"),
        (with(&["--device", "vulkan:99"]), "there are only 0 ("),
        (with(&["--device", "vulkan:no such thing"]), "there are only 0 ("),
        (with(&["--device", "cpu", "--traversal", "ray-query"]), "the CPU engine has only its own"),
        (with(&["--traversal", "magic"]), "ray-pipeline"),
    ] {
        let (_, stderr) = ends(here, 2, &arguments);
        assert!(stderr.contains(message), "{stderr}");
    }
    // By index, by a part of the name; a cache of pipelines that is damaged, or not writable, is none.
    let cache = here.join("cache");
    let by_name = format!("vulkan:{}", name[..4].to_uppercase());
    for device in ["vulkan", "vulkan:0", &by_name] {
        let arguments = [&render[..], &["--device", device, "--traversal", "auto"]].concat();
        let variables = [("XDG_CACHE_HOME", &*cache), ("ROOTN_VALIDATION", here)];
        let (_, stderr) = ends_with(here, 0, &variables, &arguments);
        assert!(stderr.contains(&name) && !stderr.contains("validation:"), "{stderr}");
        for file in std::fs::read_dir(cache.join("rootn")).unwrap() {
            std::fs::write(file.unwrap().path(), "damaged").unwrap();
        }
    }
    let (_, stderr) = ends_with(here, 0, &[("XDG_CACHE_HOME", Path::new("/dev/null"))], &with(&["--device", "vulkan"]));
    assert!(stderr.contains(&name), "{stderr}");
}

/// Ctrl-C is heard between dispatches, also where the first block of all pixels takes minutes.
#[cfg(all(feature = "vulkan", unix))]
#[test]
fn long_work_on_a_gpu_can_be_interrupted() {
    let Some(device) = crate::support::vulkan() else { return };
    if device.info().kind != rootn::estimator::vulkan::DeviceKind::Cpu {
        println!("skipped: {} may be done before it can be interrupted", device.info().name);
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let scene = cornell();
    let render = ["render", scene.to_str().unwrap(), "-o", "x.exr", "--spp", "64", "--device", "vulkan"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_rootn"));
    command.current_dir(folder.path()).args(render).args(["--width", "2000", "--height", "2000"]);
    let mut child = command.spawn().unwrap();
    std::thread::sleep(std::time::Duration::from_secs(5));
    assert!(child.try_wait().unwrap().is_none(), "it has ended before it could be interrupted");
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let start = std::time::Instant::now();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}

/// The same report from a GPU: only the device, and times, are others.
#[cfg(feature = "vulkan")]
#[test]
fn an_experiment_on_a_gpu() {
    let Some(device) = crate::support::vulkan() else { return };
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    experiment(here, &cornell(), 200, "");
    let results = |out: &str| crate::determinism::results(&here.join(out), "small");
    ends(here, 0, &["run", "small.toml", "--out", "cpu", "--device", "cpu"]);
    let variables = [("ROOTN_VALIDATION", here)];
    let run = ["run", "small.toml", "--out", "gpu", "--device", "vulkan"];
    let (_, stderr) = ends_with(here, 0, &variables, &run);
    assert!(!stderr.contains("validation:"), "{stderr}");
    let (cpu, gpu) = (results("cpu"), results("gpu"));
    for (a, b) in cpu["scenes"][0]["strategies"]
        .as_array()
        .unwrap()
        .iter()
        .zip(gpu["scenes"][0]["strategies"].as_array().unwrap())
    {
        assert_eq!(a["device"], "cpu");
        assert!(b["device"].as_str().unwrap().starts_with(&device.info().name), "{}", b["device"]);
        let error = |s: &Value| s["checkpoints"][8]["metrics"][0]["mean"]["estimate"].as_f64().unwrap();
        assert!((error(a) / error(b) - 1.0).abs() < 0.01, "{} and {}", error(a), error(b));
    }
    assert_eq!(gpu["provenance"]["devices"][0]["reason"], "it was asked for");
    // A second time nothing is computed.
    let (_, stderr) = ends_with(here, 0, &variables, &run);
    assert!(stderr.contains("0 checkpoints computed"), "{stderr}");
}
