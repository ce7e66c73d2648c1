"""The subcommands of `patchwalk`, one a module: HELP, EXAMPLE, add_arguments(parser), run(args)."""
