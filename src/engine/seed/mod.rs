//! Seeds: candidates and the exhaustive search (thesis 4.4.4).

#[cfg(test)]
mod reference_tests;
#[cfg(test)]
mod test_cases;
