//! Every sentence, table and file that speaks of claims, word by word, and the same verdicts wherever they are computed.

use crate::command_line::ends;
use std::path::{Path, PathBuf};

/// Compares with a file in tests/golden, which ROOTN_BLESS=1 writes anew.
fn same(name: &str, text: &str) {
    let path = golden(name);
    if std::env::var_os("ROOTN_BLESS").is_some() {
        std::fs::write(&path, text).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap();
    for (line, (found, wanted)) in text.lines().zip(expected.lines()).enumerate() {
        assert_eq!(found, wanted, "{name}, line {}; ROOTN_BLESS=1 writes it anew", line + 1);
    }
    assert_eq!(text, expected, "{name}: ROOTN_BLESS=1 writes it anew");
}

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)
}

/// Numbers of full length, cut to six digits: the last ones are the mathematical library's.
fn shortened(xml: &str) -> String {
    let parts = xml.split("value=\"").enumerate().map(|(i, part)| match (i, part.split_once('"')) {
        (1.., Some((number, rest))) => {
            let short = number.parse::<f64>().map_or(number.to_owned(), |x| format!("{x:.5e}"));
            format!("value=\"{short}\"{rest}")
        }
        _ => part.to_owned(),
    });
    parts.collect()
}

#[test]
fn every_sentence_and_table() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::copy(golden("claims.toml"), here.join("claims.toml")).unwrap();
    same("verify.txt", &ends(here, 1, &["verify", "claims.toml", "--quiet"]).0);
    same("verify.md", &ends(here, 1, &["verify", "claims.toml", "--quiet", "--markdown"]).0);
    same("run.txt", &ends(here, 0, &["run", "claims.toml", "--quiet"]).0);
    let read = |name: &str| std::fs::read_to_string(here.join("reports/claims").join(name)).unwrap();
    same("junit.xml", &shortened(&read("junit.xml")));
    // The last line is about the machine.
    let summary = read("summary.md");
    same("summary.md", summary.trim_end().rsplit_once('\n').unwrap().0);
}

#[test]
fn calibration_tables() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    std::fs::copy(golden("calibration.toml"), here.join("calibration.toml")).unwrap();
    let (text, _) = ends(here, 1, &["calibrate", "calibration.toml", "--quiet"]);
    same("calibration.txt", &text);
    same("calibration.md", &std::fs::read_to_string(here.join("reports/calibration.md")).unwrap());
    assert_eq!(text, ends(here, 1, &["calibrate", "calibration.toml", "--quiet", "--threads", "1"]).0);
    // Too few trials of each forecast, enough of all together.
    std::fs::copy(golden("forecasts.toml"), here.join("forecasts.toml")).unwrap();
    same("forecasts.txt", &ends(here, 0, &["calibrate", "forecasts.toml", "--quiet"]).0);
    let (_, stderr) = ends(here, 2, &["calibrate", golden("claims.toml").to_str().unwrap(), "--quiet"]);
    assert!(stderr.contains("no [calibration]"), "{stderr}");
}

/// Claims on a rendering that do not speak of seconds, all of them decided.
const RENDERED: &str = r#"
name = "rendered"
film = { width = 16, height = 16 }
max_depth = 4
[[scene]]
name = "lamp"
file = "SCENE"
[budget]
spp = 64
[reference]
spp = 512
[[strategy]]
name = "mis"
[[strategy]]
name = "importance"
preset = "importance"
[[strategy]]
name = "sobol"
preset = "sobol"
[[claim]]
text = "MIS has a hundredth of the variance"
kind = "variance-ratio"
of = "mis"
to = "importance"
at_most = 0.2
[[claim]]
text = "and less error"
kind = "error-ratio"
of = "mis"
to = "importance"
at_most = 0.8
[[claim]]
text = "not with the same variance"
kind = "variance-ratio"
of = "sobol"
to = "mis"
at_least = 0.9
[[claim]]
text = "unbiased"
kind = "unbiased"
of = "mis"
margin = 0.02
[[claim]]
text = "Sobol points agree"
kind = "agrees"
of = "sobol"
to = "mis"
margin = 0.02
[[claim]]
text = "order"
kind = "slope"
of = "mis"
at_least = -0.7
at_most = -0.3
[[claim]]
text = "independent"
kind = "variance-of-mean"
of = "mis"
at_least = 0.7
at_most = 1.4
[[claim]]
text = "finite"
kind = "finite"
of = "mis"
"#;

#[test]
fn the_same_verdicts_on_every_thread_count_and_device() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/scenes/table-lamp.xml");
    std::fs::write(here.join("test.toml"), RENDERED.replace("SCENE", scene.to_str().unwrap())).unwrap();
    let verdicts = |out: &str, rest: &[&str]| {
        let args = [&["verify", "test.toml", "--quiet", "--out", out][..], rest].concat();
        ends(here, 1, &args).0
    };
    let one = verdicts("one", &["--device", "cpu", "--threads", "1"]);
    assert_eq!(one.matches("SUPPORTED").count(), 7, "{one}");
    assert_eq!(one.matches("REFUTED").count(), 1, "{one}");
    assert_eq!(one, verdicts("two", &["--device", "cpu", "--threads", "2"]));
    assert_eq!(one, verdicts("five", &["--device", "cpu", "--threads", "5"]));
    #[cfg(feature = "vulkan")]
    if crate::support::vulkan().is_some() {
        let words = |text: &str| -> Vec<String> {
            text.lines().filter_map(|l| Some(l.split_once('.')?.0.to_owned())).collect()
        };
        assert_eq!(words(&one), words(&verdicts("gpu", &["--device", "vulkan"])));
    }
}
