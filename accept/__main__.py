from accept.cli.main import main

main()
