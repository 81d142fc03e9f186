//! Experiment files that are wrong: told with file and line, never a panic, never long.

use rootn::Error;
use rootn::estimator::Shape;
use rootn::estimator::choice::{DeviceRequest, Traversal};
use rootn::experiment::{load, plan};
use rootn::record::image::{Attributes, Layers, write_exr};
use std::path::Path;
use std::time::{Duration, Instant};

/// A file that is right, for integrals.
const INTEGRALS: &str = r#"name = "test"
question = "Why?"
film = { width = 4, height = 4 }
probes = [[1, 1]]
targets = [0.1]
[[scene]]
integrand = "linear"
[[scene]]
integrand = "step"
[budget]
spp = 16
replicates = 2
seed = 1
[[strategy]]
name = "independent"
sequence = "independent"
[[strategy]]
preset = "sobol"
[[claim]]
text = "It falls"
kind = "slope"
of = "sobol"
scene = "linear"
at_most = -0.5
confidence = 0.95
[[claim]]
text = "It is better"
kind = "variance-ratio"
of = "sobol"
to = "independent"
at_most = 1.0
"#;

/// A file that is right, for a rendered scene; SCENE stands for the path.
const RENDERED: &str = r#"name = "test"
film = { width = 4, height = 4 }
max_depth = 3
[[scene]]
file = "SCENE"
[budget]
spp = 4
[reference]
spp = 4
replicates = 2
[[strategy]]
preset = "mis"
roulette_depth = "none"
"#;

/// A file that is right, for mocks and their calibration.
const MOCKS: &str = r#"name = "test"
film = { width = 4, height = 4 }
[calibration]
repetitions = 10
[[scene]]
mock = "normal"
[budget]
spp = 4
replicates = 2
[[strategy]]
name = "narrow"
[[strategy]]
name = "wide"
stream = 1
mock = { spread = 2.0, seconds = 1e-6 }
[[claim]]
text = "It has four times the variance"
kind = "variance-ratio"
of = "wide"
to = "narrow"
at_most = 5.0
truth = 4.0
"#;

#[test]
fn mocks_and_calibrations_that_are_wrong() {
    check(
        MOCKS,
        &[
            ("mock = \"normal\"", "mock = \"norml\"", 6, "did you mean `normal`"),
            (
                "mock = \"normal\"",
                "mock = \"normal\"\nintegrand = \"disc\"",
                5,
                "one of `file`, `integrand` and `mock`",
            ),
            ("mock = \"normal\"", "integrand = \"disc\"", 15, "is for scenes with a `mock`; `disc` has none"),
            ("[budget]", "[reference]\nspp = 4\n[budget]", 7, "the value of normal is known"),
            ("spread = 2.0", "spread = 0.0", 15, "mock.spread = 0: a positive number is allowed"),
            ("spread = 2.0", "bias = nan", 15, "mock.bias = NaN: a finite number is allowed"),
            ("seconds = 1e-6", "seconds = -1.0", 15, "mock.seconds = -1: a positive number is allowed"),
            ("seconds = 1e-6", "jitter = 7.0", 15, "mock.jitter = 7: 0 to 1 is allowed"),
            ("seconds = 1e-6", "second = 1.0", 15, "did you mean `seconds`"),
            ("repetitions = 10", "repetitions = 0", 4, "1 to 1000000 are allowed"),
            ("repetitions = 10", "", 3, "missing field `repetitions`"),
            ("[calibration]\nrepetitions = 10\n", "", 20, "there is no [calibration]"),
            ("spp = 4", "spp = 4\nrelative_error = 0.01", 9, "calibration does not go with relative_error"),
            ("spp = 4", "spp = 1", 8, "calibration takes at least 2"),
            ("truth = 4.0", "truth = -4.0", 16, "truth -4 is no value that a variance-ratio can have"),
            ("truth = 4.0", "truth = inf", 16, "truth inf is no value"),
            (
                "truth = 4.0\n",
                "[[claim]]\ntext = \"It has four times the variance\"\nkind = \"finite\"\nof = \"wide\"\n",
                23,
                "a second claim with the same text",
            ),
            (
                "truth = 4.0\n",
                "[[claim]]\ntext = \"finite\"\nkind = \"finite\"\nof = \"wide\"\ntruth = 0.0\n",
                22,
                "finite has no `truth`",
            ),
        ],
    );
}

/// Loads and plans a text in a folder.
fn attempt(folder: &Path, text: &[u8], overrides: &[&str]) -> Result<(), Error> {
    let path = folder.join("test.toml");
    std::fs::write(&path, text).unwrap();
    let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
    let (parsed, text) = load::load(&path, &overrides)?;
    plan::plan(&parsed, &path, text, &DeviceRequest::Cpu, Traversal::Compute).map(drop)
}

/// (what is replaced, by what, line that is blamed or 0 where no line can be, part of the message)
type Case = (&'static str, &'static str, u32, &'static str);

fn check(base: &str, cases: &[Case]) {
    let folder = tempfile::tempdir().unwrap();
    attempt(folder.path(), base.as_bytes(), &[]).unwrap();
    let mut wrong = Vec::new();
    for &(from, to, line, said) in cases {
        assert!(base.contains(from), "{from}");
        let start = Instant::now();
        let result = attempt(folder.path(), base.replacen(from, to, 1).as_bytes(), &[]);
        let shown = result.as_ref().map_or_else(ToString::to_string, |()| "accepted".into());
        let place = format!("test.toml:{line}");
        let told = shown.contains(said) && (line == 0 || shown.contains(&place));
        if !told || !matches!(result.map_err(|e| e.exit_code()), Err(2 | 4)) {
            wrong.push(format!("{from:?} → {to:?} (line {line}, {said:?}): {shown}"));
        }
        assert!(start.elapsed() < Duration::from_secs(2), "{to:?} took {:?}", start.elapsed());
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn files_that_are_wrong() {
    check(
        INTEGRALS,
        &[
            // Names of keys.
            ("question", "qestion", 2, "did you mean `question`?"),
            ("spp = 16", "ssp = 16", 11, "did you mean `spp`?"),
            ("width = 4", "widht = 4", 3, "did you mean `width`?"),
            ("at_most = -0.5", "atmost = -0.5", 24, "did you mean `at_most`?"),
            ("preset", "presett", 18, "did you mean `preset`?"),
            ("[budget]", "[bugdet]", 10, "did you mean `budget`?"),
            ("[[claim]]", "[[clam]]", 19, "did you mean `claim`?"),
            ("seed = 1", "seed = 1\nseconds = 5", 14, "unknown field `seconds`"),
            ("name = \"test\"", "name = \"test\"\nversion = 3", 2, "unknown field `version`"),
            // Values that are none of the words.
            ("\"linear\"", "\"liner\"", 7, "did you mean `linear`?"),
            ("\"slope\"", "\"slop\"", 21, "did you mean `slope`?"),
            ("preset = \"sobol\"", "preset = \"soboll\"", 18, "did you mean `sobol`?"),
            ("sequence = \"independent\"", "sequence = \"halton\"", 16, "unknown variant `halton`"),
            ("targets", "metric = \"relmse\"\ntargets", 5, "did you mean `relMSE`?"),
            ("targets", "log = \"everything\"\ntargets", 5, "unknown variant"),
            ("targets", "max_depth = \"deep\"\ntargets", 5, "a number of edges or \"none\""),
            ("preset = \"sobol\"", "roulette_depth = \"some\"", 18, "a depth in edges or \"none\""),
            // Types.
            ("\"test\"", "5", 1, "invalid type"),
            ("\"test\"", "[\"test\"]", 1, "invalid type"),
            ("spp = 16", "spp = \"16\"", 11, "invalid type"),
            ("spp = 16", "spp = 16.5", 11, "invalid type"),
            ("spp = 16", "spp = true", 11, "invalid type"),
            ("spp = 16", "spp = 1979-05-27", 11, "invalid type"),
            ("{ width = 4, height = 4 }", "4", 3, "invalid type"),
            ("{ width = 4, height = 4 }", "{ width = 4 }", 3, "missing field `height`"),
            ("[[1, 1]]", "[1, 1]", 4, "invalid type"),
            ("[[1, 1]]", "[[1, 1, 1]]", 4, "3 numbers; a probe is [column, row]"),
            ("[[1, 1]]", "[[1]]", 4, "1 numbers; a probe is [column, row]"),
            ("[[1, 1]]", "[[-1, 0]]", 4, "invalid value"),
            ("[[1, 1]]", "[[0.5, 0]]", 4, "invalid type"),
            ("[0.1]", "0.1", 5, "invalid type"),
            ("[0.1]", "[\"1 %\"]", 5, "invalid type"),
            ("[budget]", "[[budget]]", 10, ""),
            ("at_most = -0.5", "at_most = \"small\"", 24, "invalid type"),
            // Numbers.
            ("spp = 16", "spp = 0", 11, "1 to 281474976710656 are allowed"),
            ("spp = 16", "spp = -1", 11, "invalid value"),
            ("spp = 16", "spp = 9223372036854775807", 11, "are allowed"),
            ("spp = 16", "spp = 9223372036854775808", 11, ""),
            ("spp = 16", "spp = nan", 11, "invalid type"),
            ("spp = 16", "spp = inf", 11, "invalid type"),
            ("replicates = 2", "replicates = 0", 12, "1 to 10000 are allowed"),
            ("replicates = 2", "replicates = 10001", 12, "1 to 10000 are allowed"),
            ("replicates = 2", "replicates = 4294967296", 12, "invalid value"),
            ("seed = 1", "seed = -1", 13, "invalid value"),
            ("width = 4", "width = 0", 3, "1 to 65536 are allowed"),
            ("height = 4", "height = 0", 3, "1 to 65536 are allowed"),
            ("width = 4", "width = 65537", 3, "1 to 65536 are allowed"),
            ("{ width = 4, height = 4 }", "{ width = 65536, height = 65536 }", 3, "pixels; at most"),
            ("{ width = 4, height = 4 }", "{ width = 8192, height = 4097 }", 3, "pixels; at most"),
            ("[0.1]", "[nan]", 5, "is not a positive number"),
            ("[0.1]", "[inf]", 5, "is not a positive number"),
            ("[0.1]", "[0.1, 0.0]", 5, "is not a positive number"),
            ("[0.1]", "[-0.1]", 5, "is not a positive number"),
            ("confidence = 0.95", "confidence = 1.0", 19, "not between 0.5 and 1"),
            ("confidence = 0.95", "confidence = 95.0", 19, "not between 0.5 and 1"),
            ("confidence = 0.95", "confidence = nan", 19, "not between 0.5 and 1"),
            ("at_most = -0.5", "at_most = nan", 19, "finite"),
            ("at_most = -0.5", "at_most = -inf", 19, "finite"),
            ("at_most = -0.5", "at_most = -0.5\nat_least = 0.5", 19, "above"),
            ("[[1, 1]]", "[[4, 0]]", 4, "outside the film of 4 × 4"),
            ("[[1, 1]]", "[[0, 0], [0, 4]]", 4, "outside the film of 4 × 4"),
            ("[[1, 1]]", "[[4294967295, 4294967295]]", 4, "outside the film of 4 × 4"),
            // Names.
            ("\"test\"", "\"\"", 1, "letters, digits"),
            ("\"test\"", "\"a/b\"", 1, "letters, digits"),
            ("\"test\"", "\"../up\"", 1, "letters, digits"),
            ("\"test\"", "\".\"", 1, "letters, digits"),
            ("\"test\"", "\"cells\"", 1, "letters, digits"),
            ("\"test\"", "\"naïve\"", 1, "letters, digits"),
            ("\"test\"", "\"a\\u0000b\"", 1, "letters, digits"),
            ("name = \"independent\"", "name = \"\"", 15, "control characters"),
            ("name = \"independent\"", "name = \"a\\u001bb\"", 15, "control characters"),
            ("name = \"independent\"", "name = \"sobol\"", 17, "a second strategy named `sobol`"),
            ("preset = \"sobol\"", "preset = \"sobol\"\nname = \"Independent\"", 19, "the same folder"),
            ("integrand = \"step\"", "integrand = \"step\"\nname = \"linear\"", 10, "a second scene named `linear`"),
            ("\"step\"", "\"linear\"", 8, "a second scene named `linear`"),
            ("sequence = \"independent\"", "preset = \"sobol\"", 17, "is the same strategy on the same device as"),
            // Claims about what is not there.
            ("of = \"sobol\"", "of = \"sobl\"", 19, "did you mean `sobol`?"),
            ("to = \"independent\"", "to = \"mis\"", 26, "no strategy is named `mis`"),
            ("scene = \"linear\"", "scene = \"cornell\"", 19, "no scene is named `cornell`"),
            ("to = \"independent\"\n", "", 26, "variance-ratio needs `to`"),
            ("scene = \"linear\"", "to = \"independent\"", 19, "slope is of one strategy"),
            ("at_most = -0.5\n", "", 19, "needs `at_most`, `at_least` or both"),
            ("text = \"It falls\"\n", "", 19, "missing field `text`"),
            ("kind = \"slope\"\n", "", 19, "missing field `kind`"),
            // Scenes.
            (
                "integrand = \"linear\"",
                "integrand = \"linear\"\nfile = \"x.xml\"",
                6,
                "one of `file`, `integrand` and `mock`",
            ),
            ("integrand = \"linear\"", "", 6, "one of `file`, `integrand` and `mock`"),
            (
                "integrand = \"linear\"",
                "integrand = \"linear\"\n[scene.parameters]\na = \"1\"",
                0,
                "only a scene file has parameters",
            ),
            ("integrand = \"linear\"", "file = \"x.xml\"", 6, "needs a [reference]"),
            ("[budget]", "[reference]\nspp = 4\n[budget]", 10, "the value of linear is known"),
            ("[budget]", "[reference]\nexact = nan\n[budget]", 11, "finite"),
            ("[budget]", "[reference]\nexact = 1e300\n[budget]", 11, "finite"),
            ("[budget]", "[reference]\n[budget]", 10, "exactly one of"),
            // What must be there.
            ("name = \"test\"\n", "", 0, "missing field `name`"),
            ("[budget]\nspp = 16\nreplicates = 2\nseed = 1\n", "", 0, "missing field `budget`"),
            ("spp = 16\n", "", 10, "missing field `spp`"),
            // What is no TOML.
            ("name", "name name", 1, ""),
            ("[[scene]]", "[[scene]", 6, ""),
            ("\"Why?\"", "\"Why?", 2, ""),
            ("= 16", "= = 16", 11, ""),
            ("seed = 1", "spp = 17", 13, "duplicate key"),
            ("[budget]", "[budget]\n[budget]", 11, "duplicate"),
            ("spp = 16", "spp = 0x", 11, ""),
            ("[0.1]", "[0.1", 0, ""),
        ],
    );
}

#[test]
fn rendered_scenes_that_are_wrong() {
    let scene = crate::determinism::cornell();
    let base = RENDERED.replace("SCENE", scene.to_str().unwrap());
    let folder = scene.parent().unwrap().to_str().unwrap();
    let file: &'static str = base[base.find("file = ").unwrap()..].lines().next().unwrap().to_owned().leak();
    let directory: &'static str = format!("file = {folder:?}").leak();
    check(
        &base,
        &[
            (file, "file = \"none.xml\"", 0, "none.xml"),
            (file, "file = \"\"", 0, ""),
            (file, "file = \"test.toml\"", 0, "unknown scene format"),
            (file, directory, 0, ""),
            (file, "file = \"a\\u0000.xml\"", 0, ""),
            ("[budget]", "[scene.parameters]\nno_such = \"1\"\n[budget]", 0, "no_such"),
            ("max_depth = 3", "max_depth = -1", 3, "a number of edges or \"none\""),
            ("max_depth = 3", "max_depth = 4294967296", 3, "a number of edges or \"none\""),
            ("max_depth = 3", "max_depth = 1.5", 3, "a number of edges or \"none\""),
            ("roulette_depth = \"none\"", "roulette_depth = -3", 13, "a depth in edges or \"none\""),
            ("[reference]\nspp = 4\nreplicates = 2\n", "", 4, "needs a [reference]"),
            ("[reference]\nspp = 4", "[reference]\nspp = 0", 9, "are allowed"),
            ("replicates = 2", "replicates = 1", 10, "2 to 10000 are allowed"),
            ("replicates = 2", "image = \"x.exr\"", 8, "exactly one of"),
            ("spp = 4\nreplicates = 2", "exact = 1.0\nreplicates = 2", 10, "only a rendered reference"),
            ("spp = 4\nreplicates = 2", "image = \"none.exr\"", 0, "none.exr"),
            ("spp = 4\nreplicates = 2", "image = \"test.toml\"", 0, "not an EXR image"),
        ],
    );
}

#[test]
fn reference_images_that_do_not_fit() {
    let folder = tempfile::tempdir().unwrap();
    let scene = crate::determinism::cornell();
    let text = RENDERED
        .replace("SCENE", scene.to_str().unwrap())
        .replace("spp = 4\nreplicates = 2", "image = \"reference.exr\"");
    let write = |width: usize, height: usize, layers: &[(&str, usize, f32)]| {
        let mut image = Layers::new(width, height);
        for &(name, channels, value) in layers {
            image.insert(name, channels, vec![value; width * height * channels]);
        }
        write_exr(&folder.path().join("reference.exr"), &image, &Attributes::default()).unwrap();
    };
    let said = || attempt(folder.path(), text.as_bytes(), &[]).map_err(|e| (e.exit_code(), e.to_string()));
    let fits = Shape { width: 4, height: 4, channels: 3 };
    write(fits.width, fits.height, &[("", 3, 1.0), ("std_error", 3, 0.1)]);
    assert_eq!(said(), Ok(()));
    write(4, 4, &[("", 3, 1.0), ("stderr", 3, 0.1)]);
    assert_eq!(said(), Ok(()));
    type Layer = (&'static str, usize, f32);
    let cases: [(usize, usize, &[Layer], &str); 7] = [
        (5, 4, &[("", 3, 1.0), ("std_error", 3, 0.1)], "5 × 4 pixels; the film has 4 × 4"),
        (4, 3, &[("", 3, 1.0), ("std_error", 3, 0.1)], "4 × 3 pixels"),
        (4, 4, &[("", 3, 1.0)], "must say how certain it is"),
        (4, 4, &[("", 3, 1.0), ("std_error", 1, 0.1)], "must say how certain it is"),
        (4, 4, &[("", 1, 1.0), ("std_error", 3, 0.1)], "no channels R, G, B"),
        (4, 4, &[("", 3, f32::NAN), ("std_error", 3, 0.1)], "non-finite"),
        (4, 4, &[("", 3, 1.0), ("std_error", 3, f32::INFINITY)], "non-finite"),
    ];
    for (width, height, layers, message) in cases {
        write(width, height, layers);
        let (code, shown) = said().unwrap_err();
        assert!(code == 4 && shown.contains("reference.exr") && shown.contains(message), "{shown}");
    }
    std::fs::write(folder.path().join("reference.exr"), b"").unwrap();
    assert_eq!(said().unwrap_err().0, 4);
}

#[test]
fn bytes_that_are_no_text() {
    let folder = tempfile::tempdir().unwrap();
    let whole = |text: &[u8]| attempt(folder.path(), text, &[]).unwrap_err();
    let error = whole(b"name = \"a\"\nquestion = \"\xff\"\n");
    assert!(error.to_string().contains("test.toml:2: not UTF-8"), "{error}");
    assert_eq!(whole(b"").exit_code(), 2);
    assert_eq!(whole(&[0; 1000]).exit_code(), 2);
    let long = format!("name = \"{}\"\n{}", "n".repeat(300), INTEGRALS.split_once('\n').unwrap().1);
    assert!(whole(long.as_bytes()).to_string().contains("300 letters"));
    // Larger than any experiment; nested deeper than any.
    let start = Instant::now();
    assert!(whole(&vec![b'#'; (1 << 20) + 1]).to_string().contains("at most"));
    for deep in ["[", "{a=", "[["] {
        let text = format!("{INTEGRALS}x = {}", deep.repeat(100_000));
        assert_eq!(whole(text.as_bytes()).exit_code(), 2);
    }
    let dotted = format!("{}x = 1\n{INTEGRALS}", "x.".repeat(100_000));
    assert_eq!(whole(dotted.as_bytes()).exit_code(), 2);
    let probes = INTEGRALS.replace("[[1, 1]]", &format!("[{}]", "[1, 1],".repeat(100_000)));
    assert!(whole(probes.as_bytes()).to_string().contains("100000 probes; at most"));
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
    assert_eq!(load::load(&folder.path().join("none.toml"), &[]).unwrap_err().exit_code(), 4);
    assert_eq!(load::load(folder.path(), &[]).unwrap_err().exit_code(), 4);
}

/// Every prefix, every line left out, every byte of some positions changed: an answer, and never a panic.
#[test]
fn mutations_of_our_own_files() {
    let folder = tempfile::tempdir().unwrap();
    let experiments = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    let mut random = crate::stats::Random::new("mutations");
    let mut refused = 0;
    for file in ["integrals.toml", "cornell-box.toml"] {
        let text = std::fs::read(experiments.join(file)).unwrap();
        let mut attempt = |bytes: &[u8]| {
            let path = folder.path().join(file);
            let parsed = String::from_utf8_lossy(bytes).into_owned();
            match load::parse(&path, &parsed) {
                Err(e) => {
                    refused += 1;
                    assert!(matches!(e.exit_code(), 2 | 4) && e.to_string().contains(file), "{e}");
                }
                Ok(parsed) => assert!(!parsed.scene.is_empty()),
            }
        };
        for end in 0..text.len() {
            attempt(&text[..end]);
        }
        let lines: Vec<&[u8]> = text.split_inclusive(|&b| b == b'\n').collect();
        for skip in 0..lines.len() {
            attempt(&[lines[..skip].concat(), lines[skip + 1..].concat()].concat());
            attempt(&[lines[..skip].concat(), lines[skip].to_vec(), lines[skip..].concat()].concat());
        }
        for _ in 0..2000 {
            let mut bytes = text.clone();
            let at = random.below(bytes.len() as u64) as usize;
            bytes[at] = random.below(256) as u8;
            attempt(&bytes);
        }
    }
    assert!(refused > 2000, "{refused}");
}

#[test]
fn overrides() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.toml");
    std::fs::write(&path, INTEGRALS).unwrap();
    let set = |o: &[&str]| load::load(&path, &o.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>());
    let (e, text) = set(&["budget.spp=512", "name=other", "film.width=8", "metric=MAE", "question=a = b"]).unwrap();
    assert_eq!((e.budget.spp, e.name.as_str(), e.film.unwrap().width), (512, "other", 8));
    assert_eq!((e.metric, e.question.as_deref()), (rootn::stats::Metric::Mae, Some("a = b")));
    assert!(text.starts_with(INTEGRALS) && text.contains("# --set budget.spp=512"), "{text}");
    for (o, said) in [
        ("budget.spp", "expected KEY=VALUE"),
        ("=5", "expected KEY=VALUE"),
        ("budget.=5", "expected KEY=VALUE"),
        ("budget.ssp=5", "did you mean `spp`?"),
        ("budget.spp=many", "invalid type"),
        ("name.x=1", "is not a table"),
        ("scene.0.name=x", "is not a table"),
        ("budget.spp=0", "are allowed"),
        ("film.width=0", "are allowed"),
    ] {
        let error = set(&[o]).unwrap_err();
        assert!(error.exit_code() == 2 && error.to_string().contains(said), "{o}: {error}");
    }
    // What is wrong in the file is told with its line, what --set mends is not told.
    std::fs::write(&path, INTEGRALS.replace("spp = 16", "ssp = 16")).unwrap();
    let error = set(&["name=other"]).unwrap_err();
    assert!(error.to_string().contains("test.toml:11"), "{error}");
    std::fs::write(&path, INTEGRALS.replace("spp = 16", "spp = 0")).unwrap();
    assert_eq!(set(&["budget.spp=3"]).unwrap().0.budget.spp, 3);
}

#[test]
fn our_own_files_are_right() {
    let experiments = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    let mut files = 0;
    for entry in std::fs::read_dir(&experiments).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let (parsed, text) = load::load(&path, &[]).unwrap();
            files += 1;
            // One of them compares devices.
            #[cfg(feature = "vulkan")]
            let gpu = crate::support::vulkan().is_some();
            #[cfg(not(feature = "vulkan"))]
            let gpu = false;
            if gpu || !text.contains("vulkan") {
                plan::plan(&parsed, &path, text, &DeviceRequest::Cpu, Traversal::Compute).unwrap();
            }
        }
    }
    assert!(files >= 3);
    let schema = std::fs::read_to_string(experiments.join("experiment.schema.json")).unwrap();
    assert_eq!(
        schema,
        rootn::experiment::schema(),
        "write it again: rootn schema > experiments/experiment.schema.json"
    );
}
