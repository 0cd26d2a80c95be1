"""The paper's protocol: what is varied, what is measured on each recording, in which order."""
