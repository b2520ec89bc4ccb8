"""Who may ask for what, and how often: keys, principals, rates and quotas."""
