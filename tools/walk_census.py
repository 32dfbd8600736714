from arc_suite.cli.main import main

if __name__ == "__main__":
    main("survey")
