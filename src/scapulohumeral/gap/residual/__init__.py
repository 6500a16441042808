"""What is to be explained, and its covariance without any effect."""
