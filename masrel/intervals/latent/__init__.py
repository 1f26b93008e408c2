"""The ordinal latent-trait model: severities, biases, noises and thresholds."""
