"""PyTorch on the work that the benchmark `drive` does: the 3x3x3x3 locally recurrent network over 22 min of 200 Hz samples, f32, one core.

Truncated back-propagation through time over 200 steps and an update after each 200, which is less than what it is held against:
the exact gradient and an update at every sample. Once with the recurrence of the three layers in PyTorch's own loop (`torch.nn.RNN`,
tanh in all layers), once written out as it must be where layers differ (tanh, tanh, identity).

usage: tbptt.py SAMPLES    prints `<torch version> <s of torch.nn.RNN> <s written out>`
"""

import sys
import time

import torch

STEPS = 200
RATE = 1.0 / 65536.0
TARGET = 1.0 / 64.0


def inputs(samples):
    generator = torch.Generator().manual_seed(1)
    return torch.rand((samples, 1, 3), generator=generator) - 0.5


def descend(parameters, loss):
    loss.backward()
    with torch.no_grad():
        for p in parameters:
            p -= RATE * p.grad
            p.grad = None


def built_in(u):
    net = torch.nn.RNN(3, 3, num_layers=3, nonlinearity="tanh")
    parameters = list(net.parameters())
    state = torch.zeros((3, 1, 3))
    start = time.process_time()
    for window in u.split(STEPS):
        y, state = net(window, state)
        descend(parameters, 0.5 * ((y - TARGET) ** 2).sum())
        state = state.detach()
    return time.process_time() - start


def written_out(u):
    generator = torch.Generator().manual_seed(2)

    def weight(*shape):
        return ((torch.rand(shape, generator=generator) - 0.5) * 0.5).requires_grad_()

    w, r, b = ([weight(*shape) for _ in range(3)] for shape in [(3, 3), (3, 3), (3,)])
    parameters = [*w, *r, *b]
    f = [torch.tanh, torch.tanh, lambda x: x]
    state = [torch.zeros(3) for _ in range(3)]
    start = time.process_time()
    for window in u.squeeze(1).split(STEPS):
        loss = 0.0
        for x in window:
            for l in range(3):
                x = f[l](w[l] @ x + r[l] @ state[l] + b[l])
                state[l] = x
            loss = loss + 0.5 * ((x - TARGET) ** 2).sum()
        descend(parameters, loss)
        state = [y.detach() for y in state]
    return time.process_time() - start


def main():
    torch.set_num_threads(1)
    u = inputs(int(sys.argv[1]))
    print(torch.__version__, built_in(u), written_out(u))


main()
