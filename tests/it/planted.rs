//! A catalogue of planted bugs: each is refuted by a claim fit for it, its honest twin is supported.

mod numbers;
mod renderer;

use numbers::{Number, Wrong};
use renderer::{Bug, Renderer};
use rootn::claim::{Claim, Kind};
use rootn::estimator::Estimator;
use rootn::estimator::cpu::{CpuEstimator, PreparedScene};
use rootn::estimator::integrand::Integrand;
use rootn::record::{ClaimResult, Verdict};
use rootn::run::{Contender, Options, Plan, PlannedScene, ReferencePlan, powers_of_two, run};
use rootn::sampling::strategy::Preset;
use rootn::scene::format;
use rootn::stats::Metric;
use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

/// Replicates of every run.
const REPLICATES: u32 = 16;

/// A bug, where it is looked for, and by what.
struct Case {
    bug: &'static str,
    scene: &'static str,
    kind: Kind,
    /// Largest relative difference, or largest factor, that counts as none.
    limit: f64,
    honest: Box<dyn Estimator>,
    sabotaged: Box<dyn Estimator>,
    truth: Truth,
    /// Samples per value and replicate that are spent at most.
    most: u64,
}

/// What both are held against.
enum Truth {
    /// The value of every pixel: for the honest one, for the other.
    Exact(f64, f64),
    /// The engine's own image.
    Rendered(Arc<PreparedScene>),
}

/// An experiment's scene on a small film.
fn scene(file: &str, size: u32, depth: u32, roulette: u32) -> Arc<PreparedScene> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/scenes").join(file);
    let mut scene = format::load(&path, &format::Options::sized([size; 2])).unwrap();
    scene.depth.max = Some(depth);
    scene.depth.roulette = roulette;
    Arc::new(PreparedScene::new(scene).unwrap())
}

fn cases() -> Vec<Case> {
    let lamp = scene("table-lamp.xml", 16, 2, 100);
    let hidden = scene("hidden-lamp.xml", 16, 3, 100);
    let many = scene("many-lamps.xml", 16, 2, 100);
    let room = scene("lamp-room.xml", 16, 8, 3);
    let rendered = |bug, on: &Arc<PreparedScene>, name, planted, kind, limit, most| Case {
        bug,
        scene: name,
        kind,
        limit,
        honest: Box::new(Renderer::new(on, Bug::None)),
        sabotaged: Box::new(Renderer::new(on, planted)),
        truth: Truth::Rendered(Arc::clone(on)),
        most,
    };
    let number = |bug, integrand: Integrand, honest, wrong, kind, limit, most| Case {
        bug,
        scene: integrand.label(),
        kind,
        limit,
        honest: Box::new(Number::new(integrand, honest)),
        sabotaged: Box::new(Number::new(integrand, wrong)),
        truth: Truth::Exact(integrand.integral(), integrand.integral()),
        most,
    };
    use Integrand::{Gaussian2d, Linear};
    use Kind::{Finite, Unbiased, VarianceOfMean};
    let mut cases = vec![
        rendered("light samples lack the cosine", &lamp, "table-lamp", Bug::MissingCosine, Unbiased, 0.01, 128),
        rendered("pdf 2 % too large", &lamp, "table-lamp", Bug::PdfOff, Unbiased, 0.005, 512),
        rendered("samples above 10 are cut", &hidden, "hidden-lamp", Bug::Clamp, Unbiased, 0.05, 512),
        rendered("2 % of light samples are NaN", &lamp, "table-lamp", Bug::Nan, Finite, 0.0, 128),
        rendered("the NaN are dropped", &lamp, "table-lamp", Bug::NanDropped, Unbiased, 0.005, 512),
        rendered("roulette without compensation", &room, "lamp-room", Bug::Roulette, Unbiased, 0.04, 128),
        rendered("MIS weights do not sum to 1", &lamp, "table-lamp", Bug::MisWeights, Unbiased, 0.005, 512),
        rendered(
            "lights weighted as if picked evenly",
            &many,
            "many-lamps",
            Bug::LightProbability,
            Unbiased,
            0.01,
            128,
        ),
        number("stratum off by one", Linear, Wrong::OwnStratum, Wrong::NextStratum, Unbiased, 0.01, 64),
        number("sum in half precision", Gaussian2d, Wrong::DoubleSum, Wrong::HalfSum, Unbiased, 0.002, 4096),
        number("replicates share a key", Linear, Wrong::Nothing, Wrong::SharedKey, VarianceOfMean, 1.25, 16),
        number("s²/N for Sobol points", Gaussian2d, Wrong::Nothing, Wrong::SobolIndependent, VarianceOfMean, 1.25, 16),
    ];
    let reference = number("reference 1 % too bright", Gaussian2d, Wrong::Nothing, Wrong::Nothing, Unbiased, 0.005, 64);
    let exact = Gaussian2d.integral();
    cases.push(Case { truth: Truth::Exact(exact, 1.01 * exact), ..reference });
    cases
}

impl Case {
    /// "within 1 %", "within a factor of 1.25".
    fn claim_limit(&self) -> String {
        match self.kind {
            Kind::Unbiased => format!("within {} %", 100.0 * self.limit),
            Kind::VarianceOfMean => format!("within a factor of {}", self.limit),
            _ => "none".into(),
        }
    }

    fn claim(&self) -> Claim {
        let factor = (self.kind == Kind::VarianceOfMean).then_some(self.limit);
        Claim {
            text: "is as it should be".into(),
            kind: self.kind,
            of: "estimator".into(),
            to: None,
            at_most: factor,
            at_least: factor.map(|f| 1.0 / f),
            margin: (self.kind == Kind::Unbiased).then_some(self.limit),
            error: None,
            equal: None,
            confidence: 0.99,
            truth: None,
            scene: None,
            region: None,
        }
    }

    /// The verdict on one of the two with `spp` samples.
    fn judge(&self, sabotaged: bool, spp: u64, out: &Path) -> ClaimResult {
        let estimator = if sabotaged { &*self.sabotaged } else { &*self.honest };
        let reference = match &self.truth {
            Truth::Exact(honest, other) => ReferencePlan::Exact(if sabotaged { *other } else { *honest }),
            Truth::Rendered(prepared) => ReferencePlan::Rendered {
                estimator: Box::new(CpuEstimator::new(Arc::clone(prepared), Preset::Sobol.strategy())),
                name: "MIS with Sobol points".into(),
                spp: 1024,
                replicates: 32,
            },
        };
        let strategy = Preset::Mis.strategy();
        let contender =
            Contender { name: "estimator".into(), device: "cpu".into(), strategy, estimator: Box::new(estimator) };
        let plan = Plan {
            name: "planted".into(),
            seed: 1,
            replicates: REPLICATES,
            checkpoints: powers_of_two(spp),
            metrics: vec![Metric::RelMse],
            scenes: vec![PlannedScene {
                name: self.scene.into(),
                contenders: vec![contender],
                reference,
                max_depth: None,
                rendered: true,
            }],
            claims: vec![self.claim()],
            ..Plan::default()
        };
        let options = Options { out: out.to_owned(), fresh: false, quiet: true };
        run(&plan, &options).unwrap().0.claims.remove(0)
    }
}

/// The table in `reports/calibration/planted-bugs.md`, which ROOTN_BLESS=1 writes anew.
#[test]
fn planted_bugs_are_refuted_and_their_honest_twins_supported() {
    let folder = tempfile::tempdir().unwrap();
    let mut table = String::from(
        "# Planted bugs\n\nSabotaged estimators, 16 replicates of each on a film of 16 × 16, claims at 99 %. N: the smallest \
         number of samples per value and replicate, of 2, 4, 8 …, at which the claim is refuted; what is measured there. The \
         honest twin is supported at the N in the last column. Written and checked by `cargo test planted`.\n\n\
         | bug | scene | claim | N | measured | honest twin | N |\n| --- | --- | --- | ---: | --- | --- | ---: |\n",
    );
    for case in cases() {
        let budgets = powers_of_two(case.most).into_iter().filter(|&n| n > 1);
        let refuted =
            budgets.map(|n| (n, case.judge(true, n, folder.path()))).find(|(_, r)| r.verdict == Verdict::Refuted);
        for n in powers_of_two(case.most).into_iter().filter(|n| (2..case.most).contains(n)) {
            let twin = case.judge(false, n, folder.path());
            assert_ne!(twin.verdict, Verdict::Refuted, "the honest twin of: {}, N = {n}: {}", case.bug, twin.sentence);
        }
        let honest = case.judge(false, case.most, folder.path());
        assert_eq!(honest.verdict, Verdict::Supported, "the honest twin of: {}: {}", case.bug, honest.sentence);
        let Some((n, found)) = refuted else {
            let last = case.judge(true, case.most, folder.path());
            panic!("{} is not refuted with {} samples: {}", case.bug, case.most, last.sentence);
        };
        let said =
            |r: &ClaimResult| r.sentence.split(" (claimed").next().unwrap_or_default().replace("99 % confident: ", "");
        let _ = writeln!(
            table,
            "| {} | {} | {}, {} | {n} | {} | {} | {} |",
            case.bug,
            case.scene,
            found.kind,
            case.claim_limit(),
            said(&found),
            said(&honest),
            case.most
        );
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("reports/calibration/planted-bugs.md");
    if std::env::var_os("ROOTN_BLESS").is_some() {
        std::fs::write(&path, &table).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap();
    assert_eq!(table, committed, "{} is not what was measured; ROOTN_BLESS=1 writes it anew", path.display());
}
