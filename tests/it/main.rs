//! One test binary; one file per subject.

<<<<<<< HEAD
mod intersection;
=======
mod report;
>>>>>>> 4bed5fa7ccd65c91986d5ae09866be46b4ecbb9c
mod support;
