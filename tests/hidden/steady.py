def write_steady(truth, fish, plan, folder, streams):
    raise NotImplementedError
