//! Scenario files: what they say, and what is said of bad ones.

