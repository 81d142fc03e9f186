//! The O(n) intersector that judges the BVH.
