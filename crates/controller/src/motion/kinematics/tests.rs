//! Both arms, there and back.
