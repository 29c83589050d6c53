"""Golden models, engines and studies hold the hardware against the papers."""
