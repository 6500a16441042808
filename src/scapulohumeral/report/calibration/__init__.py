"""Chapter on EMG and calibrated muscles."""
