from accept.cli import main

main()
