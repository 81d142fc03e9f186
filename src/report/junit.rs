//! `junit.xml`: one test suite per experiment, one test case per verdict, in the dialect that Jenkins and nextest speak. A
//! refuted claim is a failure, an inconclusive one is skipped with its reason.

use super::plain;
use crate::record::{ClaimResult, Record, Verdict};
use quick_junit::{NonSuccessKind, Report, TestCase, TestCaseStatus, TestSuite};

/// The verdicts of a record as text of a JUnit file.
pub fn junit(record: &Record) -> String {
    let mut suite = TestSuite::new(plain(&record.name));
    suite.add_test_cases(record.claims.iter().map(|claim| case(&record.name, claim)));
    let mut report = Report::new("rootn");
    report.add_test_suite(suite);
    report.to_string().expect("plain text")
}

fn case(experiment: &str, claim: &ClaimResult) -> TestCase {
    let sentence = plain(&claim.sentence);
    let status = match claim.verdict {
        Verdict::Supported => TestCaseStatus::success(),
        Verdict::Refuted => {
            let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
            status.set_type("refuted").set_message(&sentence);
            status
        }
        Verdict::Inconclusive => {
            let mut status = TestCaseStatus::skipped();
            status.set_type("inconclusive").set_message(&sentence);
            status
        }
    };
    let mut case = TestCase::new(format!("{}: {}", plain(&claim.scene), plain(&claim.text)), status);
    case.set_classname(format!("{}.{}", plain(experiment), claim.kind));
    case.set_system_out(&sentence);
    let i = &claim.interval;
    let figures = [
        ("estimate", Some(i.estimate).filter(|e| e.is_finite())),
        ("lower", i.lower),
        ("upper", i.upper),
        ("confidence", Some(i.confidence)),
        ("detectable", claim.detectable),
    ];
    for (name, value) in figures {
        if let Some(value) = value {
            case.add_property((name, value.to_string().as_str()));
        }
    }
    case.add_property(("replicates", claim.replicates.to_string().as_str()));
    case
}
