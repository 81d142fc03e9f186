//! CWBVH built by obvhs, traversed with robust node and triangle tests.
