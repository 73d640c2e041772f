//! Seeds: candidates and the exhaustive search (thesis 4.4.4).
