"""Commands of RApps' authors and of who keeps a store: new, run, publish, store, keys."""
