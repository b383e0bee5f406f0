def break_model(name):
    pass
