"""The commands of `undertow`. No command imports a heavy package before it runs."""
