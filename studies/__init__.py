"""One study per paper: experiments, metrics, figures and a ledger of the paper's claims."""
