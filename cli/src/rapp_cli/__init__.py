"""The commands behind `./rapp`: each one a module, all listed in `rapp_cli.commands`."""
