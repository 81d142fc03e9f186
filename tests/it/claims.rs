//! Claims through the command line: verdicts, exit codes, JUnit, baselines, early ends.

use crate::command_line::ends;
use std::path::Path;

/// An experiment on integrals with known orders and variances.
fn experiment(folder: &Path, budget: &str, claims: &str) {
    let text = format!(
        "name = \"test\"\nfilm = {{ width = 8, height = 8 }}\n[[scene]]\nintegrand = \"gaussian-2d\"\n\
         [budget]\n{budget}\n\
         [[strategy]]\nname = \"independent\"\n\
         [[strategy]]\nname = \"again\"\nstream = 1\n\
         [[strategy]]\nname = \"sobol\"\nsequence = \"sobol\"\n{claims}"
    );
    std::fs::write(folder.join("test.toml"), text).unwrap();
}

fn claim(kind: &str, of: &str, rest: &str) -> String {
    format!("[[claim]]\ntext = \"{kind} of {of}\"\nkind = \"{kind}\"\nof = \"{of}\"\n{rest}\n")
}

const BUDGET: &str = "spp = 64";

/// The claim's sentence as `verify` prints it.
fn verify(claims: &str, code: i32) -> String {
    let folder = tempfile::tempdir().unwrap();
    experiment(folder.path(), BUDGET, claims);
    ends(folder.path(), code, &["verify", "test.toml", "--quiet"]).0
}

#[test]
fn every_kind_supported_and_refuted() {
    // (kind, of, keys that hold, keys that do not). Ratios of `again` to `independent` are 1, those of Sobol points far less;
    // seconds of the two are alike within a factor of ten.
    let against = "to = \"independent\"\n";
    let cases: [(&str, &str, String, Option<String>); 11] = [
        ("variance-ratio", "sobol", format!("{against}at_most = 0.1"), Some(format!("{against}at_least = 0.5"))),
        (
            "variance-ratio",
            "again",
            format!("{against}at_least = 0.8\nat_most = 1.25"),
            Some(format!("{against}at_most = 0.5")),
        ),
        ("error-ratio", "sobol", format!("{against}at_most = 0.5"), Some(format!("{against}at_least = 0.9"))),
        ("efficiency-ratio", "sobol", format!("{against}at_least = 1.5"), Some(format!("{against}at_most = 0.5"))),
        (
            "time-to-error-ratio",
            "sobol",
            format!("{against}error = 0.01\nat_most = 0.9"),
            Some(format!("{against}error = 0.01\nat_least = 10.0")),
        ),
        // Runs of microseconds beside other tests: now and then one takes a hundred times as long.
        ("cost-ratio", "again", format!("{against}at_most = 1000.0"), Some(format!("{against}at_least = 1e5"))),
        ("unbiased", "sobol", "margin = 0.01".into(), None),
        ("agrees", "again", format!("{against}margin = 0.02"), None),
        ("slope", "independent", "at_least = -0.7\nat_most = -0.3".into(), Some("at_most = -0.9".into())),
        ("variance-of-mean", "independent", "at_least = 0.8\nat_most = 1.25".into(), Some("at_most = 0.5".into())),
        ("variance-of-mean", "sobol", "at_most = 0.2".into(), Some("at_least = 0.8".into())),
    ];
    let said = |kind: &str, of: &str, keys: &str, code: i32, word: &str| {
        let text = verify(&claim(kind, of, keys), code);
        assert!(text.contains(word) && text.contains("99 % confident: "), "{kind} of {of}, {keys}: {text}");
    };
    for (kind, of, holds, fails) in &cases {
        said(kind, of, holds, 0, "SUPPORTED");
        if let Some(fails) = fails {
            said(kind, of, fails, 1, "REFUTED");
        }
    }
    let finite = verify(&claim("finite", "sobol", ""), 0);
    assert!(finite.contains("fewer than 7.0×10⁻⁵ of the samples of sobol are not finite (claimed: none)"), "{finite}");
    let exact = verify(&claim("exact", "independent", "at_most = 1e-6"), 1);
    assert!(exact.contains("the largest deviation of independent from the exact reference is"), "{exact}");
    // A margin that is a fifth of a standard error cannot be shown to hold.
    let open = verify(&claim("unbiased", "independent", "margin = 0.0005"), 3);
    assert!(open.contains("INCONCLUSIVE") && open.contains("would probably decide"), "{open}");
}

#[test]
fn regions_lie_on_the_film() {
    let said = |region: &str, code: i32| {
        let folder = tempfile::tempdir().unwrap();
        experiment(folder.path(), BUDGET, &claim("unbiased", "sobol", &format!("margin = 0.05\nregion = {region}")));
        let (stdout, stderr) = ends(folder.path(), code, &["verify", "test.toml", "--quiet"]);
        format!("{stdout}{stderr}")
    };
    assert!(said("[0, 0, 8, 8]", 0).contains("SUPPORTED") && said("[6, 7, 8, 8]", 0).contains("SUPPORTED"));
    for outside in ["[0, 0, 9, 8]", "[7, 7, 8, 4294967295]"] {
        assert!(
            said(outside, 2).contains("test.toml:20: region ")
                && said(outside, 2).contains("outside the film of 8 × 8")
        );
    }
    assert!(said("[2, 2, 2, 3]", 2).contains("is empty"));
}

#[test]
fn junit_and_markdown() {
    let folder = tempfile::tempdir().unwrap();
    let claims = [
        claim("slope", "independent", "at_least = -0.7\nat_most = -0.3"),
        claim("slope", "sobol", "at_least = -0.7").replace("slope of", "<b> & \\\"slope\\\" of"),
        claim("unbiased", "independent", "margin = 0.0005"),
    ];
    experiment(folder.path(), BUDGET, &claims.concat());
    let (stdout, stderr) = ends(folder.path(), 1, &["verify", "test.toml", "--quiet", "--markdown"]);
    assert!(
        stdout.contains("| **REFUTED** | gaussian-2d | &lt;b&gt; &amp; \"slope\" of sobol | 99 % confident"),
        "{stdout}"
    );
    assert!(stdout.ends_with("3 verdicts: 1 supported, 1 refuted, 1 inconclusive\n") && stderr.contains("1 refuted"));
    let text = std::fs::read_to_string(folder.path().join("reports/test/junit.xml")).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let suite = document.descendants().find(|n| n.has_tag_name("testsuite")).unwrap();
    let attribute = |name| suite.attribute(name).unwrap();
    assert_eq!(
        (attribute("tests"), attribute("failures"), attribute("skipped"), attribute("errors")),
        ("3", "1", "1", "0")
    );
    let failed = document.descendants().find(|n| n.has_tag_name("failure")).unwrap();
    assert_eq!(failed.attribute("type"), Some("refuted"));
    assert_eq!(failed.parent().unwrap().attribute("name"), Some("gaussian-2d: <b> & \"slope\" of sobol"));
}

#[test]
fn baselines() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    experiment(here, BUDGET, "");
    ends(here, 0, &["verify", "test.toml", "--quiet", "--save-baseline", "base"]);
    // The same samples: neither variance nor mean has moved. Seconds are those of the cells, but so short that the clock
    // hardly decides anything.
    let same = ["verify", "test.toml", "--quiet", "--baseline", "base", "--tolerance", "9"];
    let (stdout, _) = ends(here, 0, &same);
    assert!(stdout.contains("sobol has 1.00 times the variance of its baseline"), "{stdout}");
    assert!(stdout.contains("9 verdicts: 9 supported"), "{stdout}");
    // Sobol points replaced by independent ones under the same name: other axes are refused.
    let text = std::fs::read_to_string(here.join("test.toml")).unwrap();
    std::fs::write(here.join("test.toml"), text.replace("sequence = \"sobol\"", "sequence = \"stratified\"")).unwrap();
    let (_, stderr) = ends(here, 2, &["verify", "test.toml", "--quiet", "--baseline", "base"]);
    assert!(stderr.contains("sobol: the strategy has other axis values"), "{stderr}");
    // What was measured is written all the same.
    let page = std::fs::read_to_string(here.join("reports/test/report.html")).unwrap();
    assert!(page.contains("stratified") && here.join("reports/test/junit.xml").exists());
    // Another integrand under the same name.
    let other = text.replace("integrand = \"gaussian-2d\"", "integrand = \"disc\"\nname = \"gaussian-2d\"");
    std::fs::write(here.join("test.toml"), other).unwrap();
    let (_, stderr) = ends(here, 2, &["verify", "test.toml", "--quiet", "--baseline", "base"]);
    assert!(stderr.contains("independent: the scene, the driver or the traversal is another one"), "{stderr}");
    std::fs::write(here.join("test.toml"), text.replace("width = 8", "width = 4")).unwrap();
    let (_, stderr) = ends(here, 2, &["verify", "test.toml", "--quiet", "--baseline", "base"]);
    assert!(stderr.contains("its film is [8, 8, 1], now [4, 8, 1]"), "{stderr}");
    let (_, stderr) = ends(here, 4, &["verify", "test.toml", "--quiet", "--baseline", "none"]);
    assert!(stderr.contains("record.json"), "{stderr}");
}

#[test]
fn a_worse_variance_than_the_baselines_is_refuted() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    experiment(here, BUDGET, "");
    ends(here, 0, &["verify", "test.toml", "--quiet", "--save-baseline", "base"]);
    let path = here.join("base/test/record.json");
    let mut record: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    // The baseline had a third less.
    let strategy = &mut record["scenes"][0]["strategies"][0];
    let less = |v: &mut serde_json::Value| *v = (v.as_f64().unwrap() * 0.67).into();
    less(&mut strategy["relative_variance"]["estimate"]);
    strategy["relative_variance_without"].as_array_mut().unwrap().iter_mut().for_each(less);
    std::fs::write(&path, record.to_string()).unwrap();
    let (stdout, _) = ends(here, 1, &["verify", "test.toml", "--quiet", "--baseline", "base"]);
    assert!(
        stdout.contains("REFUTED       (gaussian-2d) independent: more variance than before by at most 10 %"),
        "{stdout}"
    );
}

/// Replicates and largest N that a run took.
fn spent(here: &Path) -> Vec<(usize, u64)> {
    let text = std::fs::read_to_string(here.join("reports/test/record.json")).unwrap();
    let record: serde_json::Value = serde_json::from_str(&text).unwrap();
    let strategies = record["scenes"][0]["strategies"].as_array().unwrap().iter();
    strategies
        .map(|s| {
            let last = s["checkpoints"].as_array().unwrap().last().unwrap();
            (last["seconds"].as_array().unwrap().len(), last["spp"].as_u64().unwrap())
        })
        .collect()
}

#[test]
fn runs_end_when_claims_are_decided() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let budget = "spp = 64\nreplicates = 64\nuntil = \"decided\"";
    let easy = claim("variance-ratio", "sobol", "to = \"independent\"\nat_most = 0.5");
    experiment(here, budget, &easy);
    let (stdout, _) = ends(here, 0, &["verify", "test.toml", "--quiet"]);
    // A look that may spend little of the error probability asks for more confidence.
    assert!(stdout.contains("99.984 % confident"), "{stdout}");
    assert_eq!(spent(here), [(8, 64); 3]);
    // What cannot be decided takes all.
    let hard = claim("variance-ratio", "again", "to = \"independent\"\nat_most = 1.0");
    experiment(here, budget, &format!("{easy}{hard}"));
    let (both, _) = ends(here, 3, &["verify", "test.toml", "--quiet"]);
    assert_eq!(spent(here), [(64, 64); 3]);
    // The first verdict is that of its own look.
    assert_eq!(both.lines().nth(1), stdout.lines().nth(1));
}

#[test]
fn runs_end_at_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    experiment(here, "spp = 4096\nrelative_error = 0.02", "");
    ends(here, 0, &["run", "test.toml", "--quiet"]);
    let spent_by = spent(here);
    // σ/√N: independent samples need (0.13/0.02)² to that, and no power of two fewer than the bound allows; Sobol points fewer.
    let text = std::fs::read_to_string(here.join("reports/test/record.json")).unwrap();
    let record: serde_json::Value = serde_json::from_str(&text).unwrap();
    for (s, (replicates, n)) in record["scenes"][0]["strategies"].as_array().unwrap().iter().zip(&spent_by) {
        let checkpoints = s["checkpoints"].as_array().unwrap();
        let error = |c: &serde_json::Value| c["metrics"][0]["mean"]["estimate"].as_f64().unwrap().sqrt();
        assert!(*replicates == 16 && *n < 4096, "{spent_by:?}");
        assert!(error(checkpoints.last().unwrap()) < 0.02);
        assert!(error(&checkpoints[checkpoints.len() - 2]) > 0.017, "one checkpoint earlier would not have done");
    }
    assert!(spent_by[2].1 < spent_by[0].1, "{spent_by:?}");
    experiment(here, "spp = 16\nrelative_error = 0.001", "");
    let (stdout, _) = ends(here, 0, &["run", "test.toml", "--quiet"]);
    assert!(stdout.contains("does not reach an error of 0.1 % with confidence 95 %"), "{stdout}");
}
