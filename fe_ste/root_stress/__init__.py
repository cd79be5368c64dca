"""Tooth root stress as read-outs of the superelement: strain gauges on the fillets of the closed ring."""
