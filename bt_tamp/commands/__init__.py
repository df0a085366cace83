"""The command line's subcommands, one per file, each imported only when it is called."""
