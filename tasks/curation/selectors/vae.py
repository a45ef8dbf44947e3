"""The variational autoencoder of Behavior Retrieval.

Du, Nair, Sadigh, Finn: Behavior Retrieval: Few-Shot Imitation Learning by Querying Unlabeled Datasets, RSS 2023.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import mse_loss

from plancurate.tasks.curation.selectors.networks import in_blocks, one_thread, perceptron
from plancurate.tasks.learning.demonstrations import Float32Array

HIDDEN = (300, 400)
BETA = 1e-4  # weight of the divergence from the prior
BATCH = 256
LEARNING_RATE = 1e-3


class Autoencoder:
    """Gaussian encoder and decoder of rows of `width` numbers with `latent` numbers between them."""

    def __init__(self, width: int, latent: int, rng: torch.Generator) -> None:
        self.encoder = perceptron((width, *HIDDEN, 2 * latent), rng)
        self.decoder = perceptron((latent, *HIDDEN, width), rng)

    def loss(self, rows: Tensor, rng: torch.Generator) -> Tensor:
        """Squared error of rows (b, width) decoded from a draw, plus BETA times the divergence from N(0, 1)."""
        mean, log_variance = self.encoder(rows).chunk(2, dim=1)
        drawn = mean + torch.exp(log_variance / 2) * torch.randn(mean.shape, generator=rng)
        divergence = 0.5 * (mean**2 + log_variance.exp() - 1 - log_variance).sum(dim=1).mean()
        loss: Tensor = mse_loss(self.decoder(drawn), rows) + BETA * divergence
        return loss

    def means(self, rows: Float32Array) -> Float32Array:
        """Posterior means (rows, latent) of rows (rows, width)."""
        return in_blocks(lambda block: self.encoder(block).chunk(2, dim=1)[0], rows)

    def reconstructed(self, rows: Float32Array) -> Float32Array:
        """Rows (rows, width) decoded from their posterior means."""
        return in_blocks(self.decoder, self.means(rows))


def train_autoencoder(rows: Float32Array, latent: int, steps: int, rng: torch.Generator) -> Autoencoder:
    """Fit an autoencoder to standardised rows (rows, width) by `steps` steps of Adam."""
    table = torch.from_numpy(rows)
    vae = Autoencoder(table.shape[1], latent, rng)
    parameters = [*vae.encoder.parameters(), *vae.decoder.parameters()]
    adam = torch.optim.Adam(parameters, lr=LEARNING_RATE, fused=True)
    with one_thread():
        for _ in range(steps):
            batch = table[torch.randint(len(table), (BATCH,), generator=rng)]
            adam.zero_grad()
            vae.loss(batch, rng).backward()  # type: ignore[no-untyped-call]
            adam.step()
    return vae
